// SPDX-License-Identifier: Apache-2.0
// One soft surface over time: at rest, at any speed, over closed ways, with a damper, and switched
// while it is felt (docs/palpation.md).
#include <palpate/haptics/contact/softness.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/soft_loop.h"

namespace palpate {
namespace {

using test::ContactLoop;
using test::force;
using test::on;
using test::soft;

constexpr double kK = ContactLoop::kStiffness;
constexpr double kRadius = 50e-3; // m

// ---- at rest and at any speed ------------------------------------------------------------------

TEST(SoftSurface, AHeldProbeKeepsTheBitsOfTheTip) {
    std::mt19937 random(31);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (int trial = 0; trial < 60; ++trial) {
        SurfaceFinish finish = soft(trial % 2 == 0 ? 60.0 : 400.0, 0.0, trial % 3 == 0 ? 0.3 : 0.0);
        SteppingSettings settings; // as scenes have them
        ContactLoop loop =
            on(trial % 4 < 2 ? std::shared_ptr<const ScalarField>(make_sphere_cavity(30e-3))
                             : make_bumpy_cavity(30e-3, 0.3e-3, 8e-3),
               finish, settings);
        const double x = unit(random), y = unit(random), z = unit(random);
        const Vec3 u = glm::normalize(Vec3{x, y, z});
        loop.start(25e-3 * u);
        const Vec3 probe = 33e-3 * u;
        for (int i = 0; i < 20; ++i)
            loop.move(probe);
        const Vec3 rests = loop.proxy();
        for (int i = 0; i < 200; ++i) {
            loop.move(probe);
            ASSERT_EQ(loop.proxy(), rests) << trial << ' ' << i;
        }
    }
}

// A damper's tissue creeps to its end, by (b / T) / (k + K + b / T) a frame, and stays there.
TEST(SoftSurface, AHeldProbeKeepsTheBitsOfTheTipOnceTheTissueHasCrept) {
    for (const double stiffness : {60.0, 200.0, 400.0})
        for (const double damping : {0.5, 10.0, 80.0}) {
            ContactLoop loop = on(make_sphere_cavity(30e-3), soft(stiffness, damping), {});
            loop.start({25e-3, 0, 0});
            const Vec3 probe{30e-3, 10e-3, 8e-3};
            const Vec3 front = 30e-3 * glm::normalize(probe);
            loop.move(probe);
            EXPECT_GT(glm::length(force(loop, probe)),
                      stiffness * glm::length(probe - front) + 0.01)
                << "pressed fast it is stiffer";
            for (int i = 0; i < 6000; ++i) // e^-36 of it is left with the strongest damper
                loop.move(probe);
            const Vec3 rests = loop.proxy();
            EXPECT_LE(glm::length(force(loop, probe) - stiffness * (front - probe)), 1e-9);
            for (int i = 0; i < 200; ++i) {
                loop.move(probe);
                ASSERT_EQ(loop.proxy(), rests) << stiffness << ' ' << damping << ' ' << i;
            }
        }
}

TEST(SoftSurface, TheFrontHoldsItsCertificateAtAnySpeed) {
    std::mt19937 random(41);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    const LevelSettings level;
    const auto field = std::shared_ptr<const ScalarField>(make_torus(30e-3, 8e-3));
    const auto sampler = field->make_sampler();
    ContactLoop loop = on(field, soft(40.0), {}, level);
    loop.start({0, 0, 20e-3});
    double deepest_m = 0.0, longest_m = 0.0;
    for (int i = 0; i < 6000; ++i) {
        const double x = unit(random), y = unit(random), z = unit(random);
        const double reach = std::pow(400.0, unit(random)) * 1e-3;
        Vec3 probe = loop.proxy() + std::min(reach, 0.4) * Vec3{x, y, z};
        if (glm::length(probe) > 0.06) probe *= 0.06 / glm::length(probe);
        longest_m = std::max(longest_m, glm::length(probe - loop.proxy()));
        loop.move(probe);
        const auto path = loop.subdivision().path();
        for (std::size_t c = 1; c < path.size(); ++c)
            for (int s = 0; s <= 20; ++s)
                deepest_m = std::max(
                    deepest_m, sampler->value(path[c - 1] + s / 20.0 * (path[c] - path[c - 1])));
    }
    EXPECT_GT(longest_m, 0.1);                              // at 1 kHz more than 100 m/s
    EXPECT_LE(deepest_m, level.certificate_m * (1 + 1e-9)); // a distance field: 25 um
    EXPECT_GT(deepest_m, 0.0);                              // and it was pressed
}

// ---- energy ------------------------------------------------------------------------------------

/// Work on the hand over closed ways, J, and the bound of a zero-order hold: k/2 sum |da|^2.
struct LoopWork {
    double work_j = 0.0, bound_j = 0.0;
};

LoopWork work_of_circles(bool inside, int frames, const SurfaceFinish& finish) {
    ContactLoop loop =
        on(inside ? make_sphere_cavity(kRadius) : make_solid_sphere(kRadius), finish);
    const double sign = inside ? 1.0 : -1.0;
    const auto place = [&](int i) {
        const double s = 2.0 * std::numbers::pi * i / frames;
        const double d = 4e-3 + 3e-3 * std::sin(2.0 * s); // 1 to 7 mm behind the surface
        return (kRadius + sign * d) * Vec3{std::cos(0.3 * std::sin(s)),
                                           std::sin(0.3 * std::sin(s)) * std::cos(s),
                                           std::sin(0.3 * std::sin(s)) * std::sin(s)};
    };
    loop.start((kRadius - sign * 1e-3) * Vec3{1, 0, 0});
    for (int i = 0; i < 20; ++i)
        loop.move(place(0));
    LoopWork total;
    for (int i = 1; i <= frames; ++i) {
        const Vec3 f = force(loop, place(i - 1)), step = place(i) - place(i - 1);
        total.work_j += glm::dot(f, step);
        total.bound_j += 0.5 * kK * glm::dot(step, step);
        loop.move(place(i));
    }
    return total;
}

TEST(SoftSurface, WorkOverClosedWaysIsThatOfTheZeroOrderHold) {
    for (const bool inside : {false, true})
        for (const SurfaceFinish& finish :
             {soft(100.0), soft(400.0), soft({{2e-3, 0.1}, {4e-3, 0.7}, {8e-3, 1.0}})}) {
            const LoopWork coarse = work_of_circles(inside, 1500, finish);
            const LoopWork fine = work_of_circles(inside, 6000, finish);
            EXPECT_LE(coarse.work_j, coarse.bound_j);
            EXPECT_LE(fine.work_j, fine.bound_j);
            // Conservative: what is left is the hold's, of first order in the step.
            EXPECT_NEAR(coarse.work_j / fine.work_j, 4.0, 0.08);
        }
}

TEST(SoftSurface, ADamperTakesEnergy) {
    const LoopWork elastic = work_of_circles(false, 6000, soft(200.0));
    const LoopWork damped = work_of_circles(false, 6000, soft(200.0, 10.0));
    EXPECT_LT(damped.work_j, elastic.work_j - 1e-5);
}

// 1 Hz, 5 mm into tissue of 200 N/m and 10 N s/m: against small steps of the tissue's own equation
//   b d' + K d = k (delta - d).
TEST(SoftSurface, ADamperFollowsTheTissuesEquationInFirstOrder) {
    constexpr double kStiffness = 200.0, kDamping = 10.0;
    constexpr double kTissue = 1.0 / (1.0 / kStiffness - 1.0 / kK);
    const auto press_m = [](double t) {
        return 2.5e-3 * (1.0 - std::cos(2 * std::numbers::pi * t));
    };
    std::array<double, 3> worst{};
    for (std::size_t refined = 0; refined < worst.size(); ++refined) {
        const int frames = 1000 << refined, inner = 64;
        const double period = 1.0 / frames;
        SurfaceFinish finish = soft(kStiffness, kDamping);
        test::ScriptedClock clock(0.0);
        VolumeContact contact(std::shared_ptr<const ScalarField>(make_slab(40e-3)), {});
        Subdivision subdivision({}, {&contact}, {}, clock, {finish});
        subdivision.restart({0, 0, 21e-3});
        double d = 0.0;
        for (int i = 1; i <= frames / 2; ++i) { // while it goes in: no tip leaves the tissue
            for (int s = 1; s <= inner; ++s) {  // the midpoint rule
                const double h = period / inner;
                const double t = (i - 1) * period + (s - 0.5) * h;
                const double rate = (kK * (press_m(t) - d) - kTissue * d) / kDamping;
                const double middle = d + 0.5 * h * rate;
                d += h * (kK * (press_m(t) - middle) - kTissue * middle) / kDamping;
            }
            const Vec3 probe{0, 0, 20e-3 - press_m(i * period)};
            const SubdivisionResult result = subdivision.advance({probe, Vec3{0.0}, kK, period});
            worst[refined] = std::max(worst[refined], std::abs(kK * (result.proxy.z - probe.z) -
                                                               kK * (press_m(i * period) - d)));
        }
    }
    EXPECT_LT(worst[0], 2e-3); // N
    EXPECT_NEAR(worst[0] / worst[1], 2.0, 0.1);
    EXPECT_NEAR(worst[1] / worst[2], 2.0, 0.1);
}

// ---- live changes ------------------------------------------------------------------------------

// A damper feels nothing of the way that a front goes as its strength falls: the force follows
// that.
TEST(SoftSurface, WithADamperItIsSwitchedOffAsSmoothly) {
    struct Tissue {
        double stiffness, damping, depth_m;
    };
    for (const auto& [stiffness, damping, depth_m] :
         {Tissue{50.0, 4.0, 36e-3}, {50.0, 0.5, 36e-3}, {100.0, 4.0, 18e-3}}) {
        ContactLoop loop = on(make_slab(160e-3), soft(stiffness, damping));
        const Vec3 probe{0, 0, 80e-3 - depth_m};
        loop.start({0, 0, 81e-3});
        for (int i = 0; i < 2000; ++i)
            loop.move(probe);
        ASSERT_NEAR(force(loop, probe).z, stiffness * depth_m, 1e-6);
        loop.subdivision().gain(0, SurfacePart::strength).set(0.0);
        double before = force(loop, probe).z;
        for (int i = 0; i < 60; ++i) {
            loop.move(probe);
            const double now = force(loop, probe).z;
            EXPECT_LE(before - now, 0.08 * 5.0 + 1e-9) << stiffness << ' ' << damping << ' ' << i;
            before = now;
        }
        EXPECT_NEAR(before, 0.0, 1e-9);
    }
}

TEST(SoftSurface, SwitchedOffAndOnItFadesAndComesBack) {
    ContactLoop loop = on(make_slab(40e-3), soft(150.0));
    const Vec3 probe{0, 0, 16e-3};
    loop.start({0, 0, 21e-3});
    loop.move(probe);
    ASSERT_NEAR(force(loop, probe).z, 0.6, 1e-9);
    loop.subdivision().gain(0, SurfacePart::strength).set(0.0);
    double before = 0.6;
    for (int i = 0; i < 60; ++i) {
        loop.move(probe);
        const double now = force(loop, probe).z;
        EXPECT_LE(now, before + 1e-9);
        EXPECT_LE(before - now, 0.08 * 5.0 + 1e-9); // Gain::strength_n: 4 F T / 50 ms at most
        before = now;
    }
    EXPECT_NEAR(before, 0.0, 1e-9);
    loop.subdivision().gain(0, SurfacePart::strength).set(1.0);
    for (int i = 0; i < 60; ++i)
        loop.move({0, 0, 22e-3});
    loop.move(probe);
    EXPECT_NEAR(force(loop, probe).z, 0.6, 1e-9);
}

// A gain g below 1 leaves F g / (1 - g) of what never yields, with F the force limit of 5 N: the
// hand feels that, and not the force of a hard surface at the same depth.
TEST(SoftSurface, AGainLeavesTheStrengthThatTheHandFeels) {
    constexpr double kGain = 0.2, kLeft_n = 5.0 * kGain / (1.0 - kGain), kSoft = 150.0;
    ContactLoop loop = on(make_slab(80e-3), soft(kSoft));
    loop.start({0, 0, 41e-3});
    loop.subdivision().gain(0, SurfacePart::strength).set(kGain);
    for (int i = 0; i < 60; ++i)
        loop.move({0, 0, 41e-3});
    for (double depth_m = 1e-3; depth_m < 16e-3; depth_m += 1e-3) {
        const Vec3 probe{0, 0, 40e-3 - depth_m};
        loop.move(probe);
        EXPECT_NEAR(force(loop, probe).z, std::min(kSoft * depth_m, kLeft_n), 1e-9) << depth_m;
    }
}

} // namespace
} // namespace palpate
