// SPDX-License-Identifier: Apache-2.0
// One soft surface: against closed forms, and against a minimisation of the nested energy that
// knows nothing of fronts that are led (docs/palpation.md).
#include <palpate/haptics/contact/softness.h>

#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/haptics/contact/mesh_contact.h>
#include <palpate/haptics/contact/moving_contact.h>
#include <palpate/haptics/effects/constant_force.h>
#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/contact_kinds.h"
#include "tests/support/soft_loop.h"
#include "tests/support/stepping_methods.h"

namespace palpate {
namespace {

using test::ContactLoop;
using test::force;
using test::kEveryMethod;
using test::Kind;
using test::on;
using test::precise;
using test::soft;

constexpr double kK = ContactLoop::kStiffness;
constexpr double kTop = 5e-3;     // of the slab, m
constexpr double kRadius = 50e-3; // m
// Coordinates of centimetres times kK: a few roundings, N.
constexpr double kExact_n = 1e-12;

// ---- closed forms ------------------------------------------------------------------------------

TEST(SoftSurface, OnAPlaneTheHandFeelsItsStiffnessWithEveryMethod) {
    for (const SteppingMethod method : kEveryMethod)
        for (const double stiffness : {5.0, 50.0, 200.0, 450.0, 490.0}) {
            ContactLoop loop = on(make_slab(2 * kTop), soft(stiffness), precise(method));
            loop.start({0, 0, kTop + 1e-3});
            loop.move({0, 0, kTop});
            for (int i = 1; i <= 60; ++i) {
                const double depth = 1e-4 * i;
                const Vec3 probe{1e-4 * i, -2e-4 * i, kTop - depth};
                loop.move(probe);
                loop.move(probe); // shares and single steps: held until they are there
                loop.move(probe);
                EXPECT_NEAR(force(loop, probe).z, stiffness * depth, kExact_n);
                EXPECT_NEAR(glm::length(force(loop, probe)), stiffness * depth, 1e-9);
                const Subdivision::Pressed& pressed = loop.subdivision().pressed();
                EXPECT_NEAR(pressed.front.z, kTop, 1e-15);
                EXPECT_NEAR(pressed.indentation_m, depth * (1.0 - stiffness / kK), 1e-15);
                EXPECT_DOUBLE_EQ(pressed.slope_n_per_m, stiffness);
            }
        }
}

// Press 5 mm: the stiffness that a hand reads off is the one that was said. One that is not below
// the coupling's is a hard surface, to the bit.
TEST(SoftSurface, TheStiffnessReadOffIsTheOneThatWasSaid) {
    for (const double share : {0.01, 0.1, 0.27, 0.5, 0.9, 0.98}) {
        ContactLoop loop = on(make_solid_sphere(kRadius), soft(share * kK));
        loop.start({0, 0, kRadius + 1e-3});
        const Vec3 probe{0, 0, kRadius - 5e-3};
        loop.move(probe);
        EXPECT_NEAR(force(loop, probe).z / 5e-3 / (share * kK), 1.0, 1e-9);
    }
    for (const double share : {1.0, 1.3, 20.0}) {
        ContactLoop hard = on(make_sphere_cavity(kRadius), {});
        ContactLoop said = on(make_sphere_cavity(kRadius), soft(share * kK));
        std::mt19937 random(3);
        std::uniform_real_distribution<double> unit(-1.0, 1.0);
        Vec3 probe{0.0};
        hard.start(probe);
        said.start(probe);
        for (int i = 0; i < 2000; ++i) {
            const double x = unit(random), y = unit(random), z = unit(random);
            probe = 0.999 * probe + 1e-3 * Vec3{x, y, z + 0.5};
            hard.move(probe);
            said.move(probe);
            ASSERT_EQ(hard.proxy(), said.proxy());
        }
    }
}

/// Press, then drag, inside or outside of a sphere: the front is the nearest point, and the force
/// the law's along the radius.
void expect_sphere(bool inside, double radius, double depth, double stiffness, double step) {
    ContactLoop loop =
        on(inside ? make_sphere_cavity(radius) : make_solid_sphere(radius), soft(stiffness));
    const double sign = inside ? 1.0 : -1.0;
    loop.start({radius - sign * 1e-3, 0, 0});
    const int press = static_cast<int>(depth / step);
    for (int i = 0; i < press + 200; ++i) {
        const double d = std::min(depth, step * i);
        const double angle = i < press ? 0.0 : step / radius * (i - press);
        const Vec3 up{std::cos(angle), 0.6 * std::sin(angle), 0.8 * std::sin(angle)};
        const Vec3 probe = (radius + sign * d) * up;
        loop.move(probe);
        const Vec3 expected = -sign * stiffness * d * up;
        // A step of the tolerance may be left in the front, and one in the tip.
        ASSERT_LE(glm::length(force(loop, probe) - expected), 2.0 * kK * 1e-12)
            << "inside " << inside << " frame " << i;
    }
}

TEST(SoftSurface, OnSpheresOfBothSignsTheForceIsTheLawsAlongTheRadius) {
    for (const double stiffness : {50.0, 200.0, 450.0})
        for (const double step : {2e-4, 2e-3}) {
            expect_sphere(false, 50e-3, 10e-3, stiffness, step);
            expect_sphere(false, 10e-3, 6e-3, stiffness, step);
            expect_sphere(true, 50e-3, 10e-3, stiffness, step);
            expect_sphere(true, 10e-3, 9e-3, stiffness, step);
        }
}

TEST(SoftSurface, ATableIsFeltAsItIsWritten) {
    const std::vector<Softness::Knot> knots{{4e-3, 0.2}, {8e-3, 1.0}, {12e-3, 2.8}};
    for (const bool saturates : {false, true}) {
        auto law = knots;
        if (saturates) law.push_back({13e-3, 2.8});
        ContactLoop loop = on(make_solid_sphere(kRadius), soft(law));
        loop.start({0, 0, kRadius + 1e-3});
        for (int i = 0; i <= 160; ++i) {
            const double d = 1e-4 * (i <= 80 ? 2 * i : 2 * (160 - i)); // in to 16 mm, and out
            const Vec3 probe{0, 0, kRadius - d};
            loop.move(probe);
            double expected = d <= 4e-3    ? 50.0 * d
                              : d <= 8e-3  ? 0.2 + 200.0 * (d - 4e-3)
                              : !saturates ? 1.0 + 450.0 * (d - 8e-3)
                                           : std::min(2.8, 1.0 + 450.0 * (d - 8e-3));
            EXPECT_NEAR(force(loop, probe).z, expected, kExact_n) << i;
        }
    }
}

// ---- an independent twin -----------------------------------------------------------------------

/// A bumpy cavity, as its field's page defines it.
struct Bumps {
    double radius, amplitude, wavelength;
    Vec3 surface(const Vec3& u) const {
        const double w = 2.0 * std::numbers::pi * radius / wavelength;
        return (radius + amplitude * std::sin(w * u.x) * std::sin(w * u.y) * std::sin(w * u.z)) * u;
    }
};

/// min over x and y on the surface of  k/2 |x - a|^2 + K_t/2 |x - y|^2  by small steps downhill,
/// with derivatives from differences: it eliminates nothing.
Vec3 tip_by_descent(const Bumps& bumps, const Vec3& a, double k, double tissue, Vec3 x, Vec3 u) {
    for (int i = 0; i < 60000; ++i) {
        x -= (k * (x - a) + tissue * (x - bumps.surface(u))) / (k + tissue);
        // Downhill on the sphere of directions.
        const Vec3 e = std::abs(u.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
        const Vec3 t = glm::normalize(glm::cross(u, e)), b = glm::cross(u, t);
        constexpr double h = 1e-5;
        const auto energy = [&](const Vec3& direction) {
            const Vec3 way = x - bumps.surface(glm::normalize(direction));
            return 0.5 * glm::dot(way, way);
        };
        const double slope_t = (energy(u + h * t) - energy(u - h * t)) / (2.0 * h);
        const double slope_b = (energy(u + h * b) - energy(u - h * b)) / (2.0 * h);
        u = glm::normalize(u - (slope_t * t + slope_b * b) / (4.0 * bumps.radius * bumps.radius));
    }
    return x;
}

TEST(SoftSurface, TheTipIsTheMinimumOfTheNestedEnergy) {
    const Bumps bumps{30e-3, 0.4e-3, 12e-3};
    std::mt19937 random(21);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (int trial = 0; trial < 12; ++trial) {
        const double x = unit(random), y = unit(random), z = unit(random);
        const Vec3 u = glm::normalize(Vec3{x, y, z});
        const double stiffness = trial % 2 == 0 ? 100.0 : 350.0;
        const double tissue = 1.0 / (1.0 / stiffness - 1.0 / kK);
        ContactLoop loop =
            on(make_bumpy_cavity(bumps.radius, bumps.amplitude, bumps.wavelength), soft(stiffness));
        loop.start(0.9 * bumps.radius * u);
        Vec3 probe{0.0};
        for (int i = 1; i <= 100; ++i)
            loop.move(probe = (0.9 * bumps.radius + i * 6e-5) * u); // 3 mm behind the surface
        const Vec3 twin =
            tip_by_descent(bumps, probe, kK, tissue, loop.proxy(),
                           glm::normalize(loop.subdivision().pressed().front + 1e-5 * Vec3(1.0)));
        // What differences of 1e-5 leave in a slope.
        EXPECT_LE(glm::length(loop.proxy() - twin), 2e-9) << trial;
    }
}

// ---- strength, friction, forces ----------------------------------------------------------------

TEST(SoftSurface, AboveItsStrengthItGivesWayAndHoldsDeeper) {
    LevelSettings level;
    level.strength_n = 1.2;
    constexpr double kStiffness = 150.0, kYields_m = 1.2 / kStiffness;
    ContactLoop loop = on(make_slab(40e-3), soft(kStiffness), precise(), level);
    loop.start({0, 0, 21e-3});
    double deepest = 0.0;
    for (int i = 0; i <= 300; ++i) {
        const double d = 1e-4 * (i <= 150 ? i : 300 - i);
        const Vec3 probe{0, 0, 20e-3 - d};
        deepest = std::max(deepest, d);
        loop.move(probe);
        const double moved_m = std::max(0.0, deepest - kYields_m); // the front, by play
        const double expected = kStiffness * std::max(0.0, d - moved_m);
        EXPECT_NEAR(force(loop, probe).z, std::min(1.2, expected), 1e-9) << i;
    }
}

TEST(SoftSurface, AMembraneOpensAtItsStrength) {
    LevelSettings level;
    level.strength_n = 0.8;
    level.yielding = Yielding::opens;
    for (const double stiffness : {80.0, 300.0}) {
        ContactLoop loop = on(make_slab(40e-3), soft(stiffness), precise(), level);
        loop.start({0, 0, 21e-3});
        for (int i = 0; i <= 150; ++i) {
            const double d = 1e-4 * i;
            const Vec3 probe{0, 0, 20e-3 - d};
            loop.move(probe);
            const double expected = stiffness * d < 0.8 ? stiffness * d : 0.0;
            if (std::abs(stiffness * d - 0.8) > 1e-9) {
                EXPECT_NEAR(force(loop, probe).z, expected, 1e-9) << stiffness << ' ' << i;
            }
        }
    }
}

TEST(SoftSurface, FrictionKeepsItsConeAndAStuckFingerFeelsTheTissuesShear) {
    constexpr double kMu = 0.3, kDepth = 5e-3, kStiffness = 150.0;
    ContactLoop loop = on(make_slab(2 * kTop), soft(kStiffness, 0.0, kMu));
    loop.start({0, 0, kTop + 1e-3});
    loop.move({0, 0, kTop - kDepth});
    for (int i = 1; i <= 400; ++i) {
        const Vec3 probe{1e-5 * i, 0, kTop - kDepth};
        loop.move(probe);
        const Vec3 f = force(loop, probe);
        const double stuck_n = kStiffness * 1e-5 * i; // the same stiffness along the surface
        EXPECT_NEAR(f.z, kStiffness * kDepth, 1e-9);
        EXPECT_NEAR(-f.x, std::min(stuck_n, kMu * f.z), 1e-9) << i;
    }
}

TEST(SoftSurface, AForceBesideItShiftsTheHandExactly) {
    std::vector<std::unique_ptr<Effect>> effects;
    effects.push_back(std::make_unique<ConstantForce>(Vec3{0.05, 0, -0.4}));
    ContactLoop loop = on(make_slab(2 * kTop), soft(100.0), precise(), {}, std::move(effects));
    loop.start({0, 0, kTop + 2e-3});
    for (int i = 0; i <= 100; ++i) {
        const Vec3 probe{0, 0, kTop + 1e-3 - 5e-5 * i};
        loop.move(probe);
        // Drawn down by 0.8 mm: where that is behind the surface, 100 N/m push back.
        const double behind_m = std::max(0.0, kTop - (probe.z - 0.8e-3));
        EXPECT_NEAR(force(loop, probe).z, -0.4 + 100.0 * behind_m, kExact_n);
        EXPECT_NEAR(force(loop, probe).x, 0.05, kExact_n);
    }
}

TEST(SoftSurface, TouchesSayWhatIsFelt) {
    for (const Kind kind : {Kind::formula, Kind::mesh}) {
        std::vector<std::unique_ptr<SurfaceContact>> surfaces;
        surfaces.push_back(
            test::ball(kind, kRadius, std::numeric_limits<double>::infinity(), Yielding::holds, 4));
        ContactLoop loop(precise(), std::move(surfaces), {}, 0.0, {soft(120.0)});
        loop.start({0, 0, kRadius + 1e-3});
        TouchList touches;
        for (int i = 0; i < 200; ++i) {
            const Vec3 probe{1e-4 * i, 3e-5 * i, kRadius - 3e-3};
            loop.move(probe);
            loop.subdivision().find_touches(touches);
            Vec3 sum{0.0};
            for (const Touch& touch : touches) {
                sum += touch.force;
                // On the surface, not at the tip; a ball of 5120 facets sags by 80 um.
                if (touch.phase != Touch::Phase::ended) {
                    EXPECT_NEAR(glm::length(touch.point), kRadius, 1e-4);
                }
            }
            EXPECT_LE(glm::length(sum - force(loop, probe)), 1e-9) << test::name_of(kind) << i;
        }
    }
}

// ---- every contact, also of a body that moves ---------------------------------------------------

TEST(SoftSurface, EveryContactIsAsSoftAsItIsSaid) {
    for (const Kind kind : {Kind::formula, Kind::volume, Kind::mesh, Kind::guarded}) {
        std::vector<std::unique_ptr<SurfaceContact>> surfaces;
        surfaces.push_back(
            test::ball(kind, 60e-3, std::numeric_limits<double>::infinity(), Yielding::holds, 6));
        ContactLoop loop({}, std::move(surfaces), {}, 0.0, {soft(120.0)});
        loop.start({0, 0, 61e-3});
        for (int i = 0; i < 400; ++i) {
            const double angle = 5e-4 * i;
            const Vec3 up{std::sin(angle), 0, std::cos(angle)};
            const Vec3 probe = (60e-3 - std::min(4e-3, 1e-4 * i)) * up;
            loop.move(probe);
            // Meshes of 81 920 facets and voxels of 0.5 mm err by 15 um in depth, and a facet's
            // edge holds the front up to 0.5 mm aside.
            EXPECT_NEAR(glm::length(force(loop, probe)), 120.0 * (60e-3 - glm::length(probe)),
                        120.0 * 30e-6)
                << test::name_of(kind) << ' ' << i;
        }
    }
}

TEST(SoftSurface, ABodyThatMovesPressesAsDeepAsItComes) {
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    surfaces.push_back(std::make_unique<MovingContact>(std::make_unique<VolumeContact>(
        std::shared_ptr<const ScalarField>(make_slab(40e-3)), LevelSettings{})));
    MovingSurface* body = surfaces.front()->moving();
    ContactLoop loop(precise(), std::move(surfaces), {}, 0.0, {soft(150.0)});
    const Vec3 probe{0, 0, 21e-3};
    loop.start(probe);
    for (int i = 0; i <= 60; ++i) {
        RigidPose pose;
        pose.position = {0, 0, 1e-4 * i};
        body->set_pose(pose);
        loop.move(probe);
        EXPECT_NEAR(force(loop, probe).z, 150.0 * std::max(0.0, 1e-4 * i - 1e-3), 1e-9) << i;
    }
}

TEST(SoftSurface, AfterSilenceItsDamperSaysNothing) {
    auto loop = test::on(make_solid_sphere(50e-3), test::soft(100.0, 20.0));
    loop.start({0, 0, 51e-3});
    loop.move({0, 0, 51e-3});
    const Vec3 probe{0, 0, 45e-3};
    constexpr double kCoupling = test::ContactLoop::kStiffness;
    const SubdivisionResult result =
        loop.subdivision().advance({probe, loop.proxy(), kCoupling, 1e-3, 5.0, true});
    EXPECT_NEAR(kCoupling * (result.proxy.z - probe.z), 100.0 * 5e-3, 1e-9);
}

TEST(SoftSurface, ATipThatLeavesASlowTissueTouchesNothing) {
    auto loop = test::on(make_solid_sphere(50e-3), test::soft(200.0, 6.0));
    loop.start({0, 0, 51e-3});
    for (int i = -10; i <= 80; ++i)
        loop.move({0, 0, 50e-3 - 1e-4 * i});
    int left = 0;
    for (int i = 80; i > 2; i -= 2) {
        const Vec3 probe{0, 0, 50e-3 - 1e-4 * i};
        const SubdivisionResult result = loop.move(probe);
        const bool presses = test::force(loop, probe).z > 1e-9;
        EXPECT_EQ(result.felt, presses ? 1u : 0u) << i;
        EXPECT_EQ(result.contacts, presses ? 1u : 0u) << i;
        if (presses) continue;
        ++left;
        EXPECT_GT(loop.subdivision().pressed().indentation_m, 0.0) << i << ": in the dent";
        TouchList touches;
        loop.subdivision().find_touches(touches);
        for (const Touch& touch : touches)
            EXPECT_EQ(touch.phase, Touch::Phase::ended) << i;
    }
    EXPECT_GT(left, 3);
}

} // namespace
} // namespace palpate
