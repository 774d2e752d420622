// SPDX-License-Identifier: Apache-2.0
// One soft surface that is stiffer over what lies beneath: its force is that of an energy
// (docs/palpation.md).
#include <palpate/volume/fields/stiffness_map.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/haptics/contact/moving_contact.h>
#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/contact_loop.h"

namespace palpate {
namespace {

using test::ContactLoop;

constexpr double kK = ContactLoop::kStiffness;
constexpr double kRadius = 50e-3;    // m
constexpr double kStiffness = 135.0; // N/m, and kStiffer times that on the other side
constexpr double kStiffer = 1.2222;
constexpr double kDeep = 8e-3; // m

/// 1 on the side of negative x, `stiffer` beyond, over 10 mm; the same for all y and z there.
std::shared_ptr<const StiffnessMap> flank(double stiffer) {
    const StiffnessMap::Lattice lattice{{41, 21, 21}, {-40e-3, -20e-3, 30e-3}, 2e-3};
    std::vector<float> gains;
    for (int k = 0; k < lattice.size[2]; ++k)
        for (int j = 0; j < lattice.size[1]; ++j)
            for (int i = 0; i < lattice.size[0]; ++i) {
                const double t = std::clamp(lattice.place(i, j, k).x / 10e-3 + 0.5, 0.0, 1.0);
                gains.push_back(static_cast<float>((stiffer - 1.0) * t * t * (3.0 - 2.0 * t)));
            }
    return std::make_shared<StiffnessMap>(lattice, gains);
}

SurfaceFinish soft(double stiffness_n_per_m, double damping = 0.0) {
    SurfaceFinish finish;
    finish.softness = Softness::linear(stiffness_n_per_m);
    finish.softness.damping = damping;
    return finish;
}

SteppingSettings precise() {
    SteppingSettings settings;
    settings.tolerance_m = 1e-12;
    settings.evaluation_cap = 60;
    return settings;
}

/// A ball (sign 1) or a cavity (-1), its surface over the flank at x = 0, z = kRadius.
ContactLoop on(double sign, SurfaceFinish finish, std::shared_ptr<const StiffnessMap> map) {
    finish.stiffness = std::move(map);
    return {
        precise(),
        test::one_surface(sign > 0.0 ? make_solid_sphere(kRadius) : make_sphere_cavity(kRadius)),
        {},
        10.0,
        {finish}};
}

/// Behind the surface by `deep`, at an angle from the z axis towards x.
Vec3 place(double sign, double angle, double deep) {
    return (kRadius - sign * deep) * Vec3{std::sin(angle), 0.0, std::cos(angle)};
}

Vec3 force(const ContactLoop& loop, const Vec3& probe) { return kK * (loop.proxy() - probe); }

/// Work on the hand, J, over a closed way.
struct Work {
    double felt = 0.0;
    double normal_alone = 0.0;   // without the force along the surface
    double not_carried = 0.0;    // with P grad K alone, without (1 + delta h)^-1
    double greatest_aside = 0.0; // of the force along the surface, N
};

/// Down on the soft side, across, up, and back in front of the surface; or the other way round. A
/// force is held until the next of `frames` frames.
Work around(double sign, bool backwards, int frames, double damping = 0.0) {
    ContactLoop loop = on(sign, soft(kStiffness, damping), flank(kStiffer));
    constexpr double angle = 0.25;  // 12 mm
    const auto at = [&](double t) { // t of [0, 1]
        if (backwards) t = 1.0 - t;
        const double leg = 4.0 * t;
        if (leg < 1.0) return place(sign, -angle, kDeep * leg);
        if (leg < 2.0) return place(sign, angle * (2.0 * (leg - 1.0) - 1.0), kDeep);
        if (leg < 3.0) return place(sign, angle, kDeep * (3.0 - leg));
        return place(sign, angle * (1.0 - 2.0 * (leg - 3.0)), 0.0);
    };
    Work work;
    loop.start(place(sign, -angle, -1e-3));
    loop.move(at(0.0));
    for (int i = 0; i < frames; ++i) {
        const Vec3 probe = at(static_cast<double>(i) / frames);
        const Vec3 way = at((i + 1.0) / frames) - probe;
        loop.move(probe);
        const Vec3 felt = force(loop, probe);
        const Vec3 behind = loop.subdivision().pressed().front - probe;
        const double delta = glm::length(behind);
        if (!(delta > 1e-9)) continue;
        const Vec3 n = behind / delta, normal = glm::dot(felt, n) * n, aside = felt - normal;
        work.felt += glm::dot(felt, way);
        work.normal_alone += glm::dot(normal, way);
        work.not_carried += glm::dot(normal + (1.0 - sign * delta / kRadius) * aside, way);
        work.greatest_aside = std::max(work.greatest_aside, glm::length(aside));
    }
    return work;
}

TEST(StiffnessOverLumps, TheForceIntoTheSurfaceIsTheLawsTimesTheRatio) {
    for (const double sign : {1.0, -1.0}) {
        ContactLoop loop = on(sign, soft(kStiffness), flank(kStiffer));
        loop.start(place(sign, -0.3, -1e-3));
        for (int i = 0; i <= 300; ++i) {
            const double angle = -0.3 + 2e-3 * i, deep = 2e-5 * (i + 1);
            const Vec3 probe = place(sign, angle, deep);
            loop.move(probe);
            const double ratio = flank(kStiffer)->sample(place(sign, angle, 0.0)).ratio;
            const Vec3 n = sign * glm::normalize(probe);
            EXPECT_NEAR(glm::dot(force(loop, probe), n), ratio * kStiffness * deep, 1e-8);
        }
    }
}

// U = rho(y) K delta^2 / 2. Central differences are off by the step times how the slope of rho
// jumps between cells of its spline: 4 mJ times 1e4 / m^2 times the step, 4e-7 N.
TEST(StiffnessOverLumps, TheForceIsTheSlopeOfAnEnergy) {
    const auto map = flank(kStiffer);
    for (const double sign : {1.0, -1.0}) {
        const auto energy = [&](const Vec3& probe) {
            const double delta = sign * (kRadius - glm::length(probe));
            return 0.5 * kStiffness * map->sample(kRadius * glm::normalize(probe)).ratio * delta *
                   delta;
        };
        for (const double angle : {-0.07, -0.02, 0.013, 0.09}) {
            const Vec3 probe = place(sign, angle, kDeep);
            ContactLoop loop = on(sign, soft(kStiffness), map);
            loop.start(place(sign, angle, -1e-3));
            loop.move(probe);
            Vec3 slope{0.0};
            constexpr double step = 1e-8;
            for (int axis = 0; axis < 3; ++axis) {
                Vec3 way{0.0};
                way[axis] = step;
                slope[axis] = (energy(probe + way) - energy(probe - way)) / (2.0 * step);
            }
            EXPECT_LT(glm::length(force(loop, probe) + slope), 1e-6);
        }
    }
}

// A force that is held for a frame errs by half of how it changes within it, so the work over a
// closed way falls with the step: it comes of the zero-order hold, and of nothing else.
TEST(StiffnessOverLumps, WorkOverClosedWaysIsThatOfTheZeroOrderHold) {
    for (const double sign : {1.0, -1.0})
        for (const bool backwards : {false, true}) {
            const Work coarse = around(sign, backwards, 3000),
                       fine = around(sign, backwards, 12000);
            EXPECT_NEAR(coarse.felt / fine.felt, 4.0, 0.08) << sign << backwards;
            EXPECT_LT(std::abs(fine.felt), 0.02e-3);
            // The controls: without the force along the surface, and without how the front follows.
            EXPECT_GT(std::abs(fine.normal_alone), 0.5e-3);
            EXPECT_GT(std::abs(fine.not_carried), 0.1e-3);
            EXPECT_GT(fine.greatest_aside, 0.05);
        }
}

TEST(StiffnessOverLumps, WithADamperAClosedWayTakesWork) {
    for (const bool backwards : {false, true})
        EXPECT_LT(around(1.0, backwards, 3000, 5.0).felt, 0.0);
}

// A ratio that would make it stiffer than the coupling makes it as stiff as that.
TEST(StiffnessOverLumps, NothingIsStifferThanTheCoupling) {
    ContactLoop loop = on(1.0, soft(450.0), flank(1.5));
    loop.start(place(1.0, 0.2, -1e-3));
    const Vec3 probe = place(1.0, 0.2, 5e-3);
    loop.move(probe);
    EXPECT_NEAR(glm::length(force(loop, probe)), kK * 5e-3, 1e-9);
    EXPECT_NEAR(loop.subdivision().pressed().slope_n_per_m, kK, 1e-9);
    EXPECT_NEAR(loop.subdivision().pressed().indentation_m, 0.0, 1e-15);
}

TEST(StiffnessOverLumps, AHeldProbeKeepsTheBitsOfTheTip) {
    ContactLoop loop = on(-1.0, soft(kStiffness), flank(kStiffer));
    loop.start(place(-1.0, 0.0, -1e-3));
    const Vec3 probe = place(-1.0, 0.01, kDeep);
    loop.move(probe);
    loop.move(probe);
    const Vec3 tip = loop.proxy();
    for (int i = 0; i < 200; ++i) {
        loop.move(probe);
        ASSERT_EQ(loop.proxy(), tip);
    }
}

TEST(StiffnessOverLumps, AMapOfOneIsNoneToTheBit) {
    ContactLoop with = on(1.0, soft(kStiffness), flank(1.0));
    ContactLoop without = on(1.0, soft(kStiffness), nullptr);
    SCOPED_TRACE("seed 4");
    std::mt19937 random(4);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    with.start({0, 0, kRadius + 1e-3});
    without.start({0, 0, kRadius + 1e-3});
    Vec3 probe{0, 0, kRadius};
    for (int i = 0; i < 1000; ++i) {
        const double x = unit(random), y = unit(random), z = unit(random);
        probe = place(1.0, 0.2 * x, 5e-3 * (1.0 + z)) + Vec3{0, 5e-3 * y, 0};
        with.move(probe);
        without.move(probe);
        ASSERT_EQ(with.proxy(), without.proxy());
    }
}

TEST(StiffnessOverLumps, IsRefusedWhereItsForceWouldBeThatOfNoEnergy) {
    SurfaceFinish rubs = soft(kStiffness);
    rubs.friction = {0.3, 0.3};
    EXPECT_THROW(on(1.0, rubs, flank(1.2)), std::invalid_argument);
    SurfaceFinish yields = soft(kStiffness);
    yields.strength_n = 2.0;
    EXPECT_THROW(on(1.0, yields, flank(1.2)), std::invalid_argument);
    EXPECT_THROW(on(1.0, SurfaceFinish{}, flank(1.2)), std::invalid_argument);
    // Not alone.
    SurfaceFinish plain = soft(kStiffness);
    plain.stiffness = flank(1.2);
    std::vector<std::unique_ptr<SurfaceContact>> two;
    two.push_back(std::make_unique<VolumeContact>(make_solid_sphere(kRadius), LevelSettings{}));
    two.push_back(
        std::make_unique<VolumeContact>(make_solid_sphere(0.5 * kRadius), LevelSettings{}));
    EXPECT_THROW(ContactLoop(precise(), std::move(two), {}, 10.0, {plain, SurfaceFinish{}}),
                 std::invalid_argument);
}

} // namespace
} // namespace palpate
