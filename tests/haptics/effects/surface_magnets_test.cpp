// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/effects/surface_magnets.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include <palpate/haptics/contact/guarded_contact.h>
#include <palpate/haptics/effects/constant_force.h>
#include <palpate/haptics/stepping/frame_flags.h>
#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/brute_force_queries.h"
#include "tests/support/contact_loop.h"
#include "tests/support/mesh_fuzz.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

using test::ContactLoop;

constexpr double kK = ContactLoop::kStiffness;
constexpr double kRadius = 20e-3;
constexpr double kTop = 5e-3; // of the slab
// What is converged to 1e-12 m, with room for the last step's.
constexpr double kWithin = 1e-9;
// Coordinates of millimetres: a few roundings.
constexpr double kExact = 1e-15;

constexpr std::array<SteppingMethod, 3> kMethods{SteppingMethod::adaptive, SteppingMethod::single,
                                                 SteppingMethod::fixed};

SteppingSettings precise(SteppingMethod method = SteppingMethod::adaptive) {
    SteppingSettings settings;
    settings.method = method;
    settings.tolerance_m = 1e-12;
    settings.evaluation_cap = 60;
    return settings;
}

SurfaceFinish magnetic(double strength_n, double capture_m, double mu = 0.0) {
    return {{mu, mu}, {strength_n, capture_m}};
}

ContactLoop on(std::unique_ptr<ScalarField> field, const SurfaceFinish& finish,
               const SteppingSettings& settings = precise(), const LevelSettings& level = {}) {
    return {settings, test::one_surface(std::move(field), level), {}, 0.0, {finish}};
}

std::unique_ptr<ScalarField> ball(bool inside) {
    return inside ? make_sphere_cavity(kRadius) : make_solid_sphere(kRadius);
}

Vec3 random_direction(std::mt19937& random) {
    std::normal_distribution<double> normal;
    const double x = normal(random), y = normal(random), z = normal(random);
    return glm::normalize(Vec3{x, y, z});
}

TEST(SurfaceMagnets, OnAPlaneThePullOffHeightIsExact) {
    for (const SteppingMethod method : kMethods) {
        ContactLoop loop = on(make_slab(2 * kTop), magnetic(0.4, 2e-3), precise(method));
        loop.start({0, 0, kTop + 1e-3});
        for (int i = 0; i <= 300; ++i) {
            const double h = 1e-5 * i;
            const Vec3 probe{2e-4 * i, -1e-4 * i, kTop + h};
            loop.move(probe);
            if (i == 0) continue; // one evaluation flies to the surface, and no farther
            EXPECT_NEAR(loop.proxy().z, kTop + std::max(0.0, h - 0.4 / kK), kExact) << i;
            EXPECT_NEAR(loop.proxy().x, probe.x, 64 * kExact); // of 60 mm
            EXPECT_NEAR(loop.proxy().y, probe.y, 64 * kExact);
        }
    }
}

TEST(SurfaceMagnets, PressedOnThereIsNoDifference) {
    for (const bool inside : {true, false}) {
        ContactLoop plain = on(ball(inside), {});
        ContactLoop drawn = on(ball(inside), magnetic(2.0, 1e-3));
        const double start = inside ? kRadius - 1e-6 : kRadius + 1e-6;
        const double depth = inside ? 1e-3 : -1e-3;
        plain.start({start, 0, 0});
        drawn.start({start, 0, 0});
        for (int i = 0; i < 500; ++i) {
            const double angle = 2e-3 * i;
            const Vec3 probe = (kRadius + depth) * Vec3{std::cos(angle), std::sin(angle), 0};
            plain.move(probe);
            drawn.move(probe);
            ASSERT_LE(glm::length(plain.proxy() - drawn.proxy()), 1e-11) << i;
        }
    }
}

// The proxy is on the sphere under the hand, or along the radius where the hand pulls harder.
TEST(SurfaceMagnets, OnBothSidesOfASphereTheProxyIsUnderTheHand) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    for (const bool inside : {true, false}) {
        std::uint32_t most = 0;
        double sum = 0.0;
        for (int trial = 0; trial < 500; ++trial) {
            const double strength = 0.05 + unit(random);
            ContactLoop loop = on(ball(inside), magnetic(strength, 1e-3));
            const double out = inside ? -1.0 : 1.0;
            loop.start({kRadius + out * 0.5e-3, 0, 0});
            loop.move({kRadius, 0, 0});
            const double angle = 0.25 * unit(random);
            const double h = std::min(3e-3 * unit(random), strength / kK + 0.8e-3);
            const Vec3 up{std::cos(angle), std::sin(angle) * 0.6, std::sin(angle) * 0.8};
            const SubdivisionResult result = loop.move((kRadius + out * h) * up);
            const Vec3 expected = (kRadius + out * std::max(0.0, h - strength / kK)) * up;
            ASSERT_LE(glm::length(loop.proxy() - expected), kWithin)
                << "strength " << strength << " h " << h << " angle " << angle << " inside "
                << inside << " flags " << result.flags;
            most = std::max(most, result.evaluations);
            sum += result.evaluations;
        }
        // Newton: jumps of up to 5 mm along the sphere are cut to chords, then squared away.
        EXPECT_LE(most, 16u) << inside;
        EXPECT_LE(sum / 500, 8.0) << inside;
    }
}

TEST(SurfaceMagnets, DraggedAlongASphereItStaysThere) {
    for (const bool inside : {true, false}) {
        ContactLoop loop = on(ball(inside), magnetic(1.0, 1e-3));
        const double out = inside ? -1.0 : 1.0;
        loop.start({kRadius + out * 0.5e-3, 0, 0});
        for (int i = 0; i <= 2000; ++i) {
            const double angle = 0.01 * i; // 0.2 m/s
            const double h = 1.5e-3 * (0.5 - 0.5 * std::cos(0.02 * i));
            const Vec3 up{std::cos(angle), std::sin(angle), 0};
            const SubdivisionResult result = loop.move((kRadius + out * h) * up);
            ASSERT_EQ(result.flags, 0u) << i;
            ASSERT_LE(glm::length(loop.proxy() - kRadius * up), kWithin) << i;
        }
    }
}

TEST(SurfaceMagnets, ForcesCountAsTheHandDoes) {
    std::vector<std::unique_ptr<Effect>> effects;
    effects.push_back(std::make_unique<ConstantForce>(Vec3{0.1, 0, 0.3}));
    ContactLoop loop(precise(), test::one_surface(make_slab(2 * kTop)), std::move(effects), 0.0,
                     {magnetic(0.4, 2e-3)});
    loop.start({0, 0, kTop + 1e-6});
    for (int i = 0; i <= 100; ++i) {
        const double h = 1e-5 * i;
        loop.move({0, 0, kTop + h});
        ASSERT_NEAR(loop.proxy().z, kTop + std::max(0.0, h + (0.3 - 0.4) / kK), kExact) << i;
        ASSERT_NEAR(loop.proxy().x, 0.1 / kK, kExact);
    }
}

// Friction goes by what the hand presses the proxy on with.
TEST(SurfaceMagnets, WithFrictionItSlidesFreelyUntilItIsPressedOn) {
    constexpr double kMu = 0.3;
    ContactLoop loop = on(make_slab(2 * kTop), magnetic(0.4, 1e-3, kMu));
    loop.start({0, 0, kTop + 1e-4});
    for (int i = 0; i <= 100; ++i) {
        const SubdivisionResult result = loop.move({1e-4 * i, 0, kTop + 0.5e-3});
        ASSERT_NEAR(loop.proxy().x, 1e-4 * i, 16 * kExact);
        ASSERT_NEAR(loop.proxy().z, kTop, kExact);
        ASSERT_EQ(result.flags, 0u);
    }
    for (int i = 100; i <= 300; ++i)
        loop.move({1e-4 * i, 0, kTop - 2e-3});
    EXPECT_NEAR(loop.proxy().x, 30e-3 - kMu * 2e-3, 16 * kExact);
    EXPECT_NEAR(loop.proxy().z, kTop, kExact);
}

TEST(SurfaceMagnets, ASkinThatYieldedDrawsTheProxyOnItsOwnLevelAgain) {
    LevelSettings skin;
    skin.strength_n = 1.0;
    constexpr double kSkin = 20e-3;
    for (const SteppingMethod method : kMethods) {
        ContactLoop loop = on(make_slab(2 * kSkin), magnetic(0.4, 2e-3), precise(method), skin);
        loop.start({0, 0, kSkin + 1e-6});
        for (int i = 0; i <= 100; ++i) {
            const double depth = 1e-4 * i;
            loop.move({0, 0, kSkin - depth});
            if (i == 0) continue;
            ASSERT_NEAR(loop.proxy().z, kSkin - std::max(0.0, depth - 1.0 / kK), 1e-12) << i;
        }
        for (int i = 100; i >= -200; --i) {
            const double h = -1e-4 * i;
            loop.move({0, 0, kSkin + h});
            const double z = loop.proxy().z - kSkin;
            if (h > 0.4 / kK + 1.5e-3) continue; // let go by and by
            // Held where it was pushed to, lifted off from there, then drawn.
            const double expected = h <= 0.0 ? std::max(h, -8e-3) : std::max(0.0, h - 0.4 / kK);
            ASSERT_NEAR(z, expected, 1e-12) << i;
        }
    }
}

TEST(SurfaceMagnets, WhatHasOpenedDrawsNobody) {
    LevelSettings membrane;
    membrane.strength_n = 1.0;
    membrane.yielding = Yielding::opens;
    ContactLoop loop = on(make_slab(2 * kTop), magnetic(0.4, 1e-3), precise(), membrane);
    loop.start({0, 0, kTop + 1e-6});
    loop.move({0, 0, kTop - 3e-3});
    ASSERT_EQ(loop.surface(0).state(), SurfaceState::inside);
    for (const double depth : {3e-3, 1e-3, 1e-5}) {
        loop.move({0, 0, kTop - depth});
        EXPECT_EQ(loop.proxy(), Vec3(0, 0, kTop - depth));
    }
}

TEST(SurfaceMagnets, SnapsOnAtTheCaptureDistanceAndLetsGoBeyond) {
    constexpr double kCapture = 1e-3;
    for (const double strength : {0.1, 0.4, 2.0}) { // 2 N draws it all the way
        ContactLoop loop = on(make_slab(2 * kTop), magnetic(strength, kCapture));
        loop.start({0, 0, kTop + 3e-3});
        int snaps = 0, releases = 0;
        bool held = false;
        std::mt19937 random(2);
        std::uniform_real_distribution<double> tremor(-1e-5, 1e-5);
        for (int i = 0; i <= 2000; ++i) { // to the capture distance, slowly, and back
            const double h = 0.9e-3 + 4.5e-3 * std::abs(i - 1000) / 1000.0 + tremor(random);
            const Vec3 probe{0, 0, kTop + h};
            loop.move(probe);
            const Vec3 force = kK * (loop.proxy() - probe);
            const bool holds = glm::length(force) > 0.0;
            if (holds && !held) {
                ++snaps;
                EXPECT_LE(glm::length(force),
                          std::min(strength, kK * kCapture) + kK * 2e-5); // and the tremor's
            }
            if (!holds && held) ++releases;
            held = holds;
            if (!holds) continue;
            EXPECT_LE(loop.proxy().z - kTop, GuideCapture::kRelease * kCapture + 3e-5);
        }
        EXPECT_EQ(snaps, 1) << strength;
        EXPECT_EQ(releases, 1) << strength;
    }
}

// It draws the proxy farther than the force limit of 5 N stretches the coupling, 2.5 mm, to a rough
// wall where frames are cut short by their cap.
TEST(SurfaceMagnets, OneStrongerThanTheForceLimitIsReachedFromAfar) {
    constexpr double kAmplitude = 1e-3, kWall = 30e-3, kAway = 7e-3, kStiff = 2000.0,
                     kLimit_n = 5.0;
    std::mt19937 random(11);
    int cut_short = 0;
    for (int trial = 0; trial < 40; ++trial) {
        ContactLoop loop = on(make_bumpy_cavity(kWall, kAmplitude, 6e-3), magnetic(50.0, 20e-3),
                              SteppingSettings{});
        const Vec3 probe = (kWall - kAway) * random_direction(random);
        loop.start(probe);
        Vec3 proxy = probe;
        for (int i = 0; i < 30; ++i) {
            const SubdivisionResult result =
                loop.subdivision().advance({probe, proxy, kStiff, 1e-3, kLimit_n});
            proxy = result.proxy;
            cut_short += (result.flags & kEvaluationCap) != 0;
        }
        // 50 N over 2000 N/m are 25 mm: it comes to the wall, which is 6 to 8 mm away.
        EXPECT_GT(glm::length(proxy - probe), kAway - kAmplitude - kWithin) << trial;
    }
    EXPECT_GT(cut_short, 0);
}

TEST(SurfaceMagnets, SwitchedOffItLetsGo) {
    constexpr double kCapture = 1e-3, kStrength = 1.0;
    ContactLoop loop = on(make_slab(2 * kTop), magnetic(kStrength, kCapture));
    const Vec3 between{0, 0, kTop + 1.2 * kCapture}; // it would not snap on here, but hold on
    loop.start({0, 0, kTop + 0.5 * kCapture});
    loop.move({0, 0, kTop + 0.5 * kCapture});
    loop.move(between);
    EXPECT_LE(loop.proxy().z, kTop + kExact);
    loop.subdivision().gain(0, SurfacePart::magnet).set(0.0);
    for (int i = 0; i < 100; ++i) // longer than the ramp
        loop.move(between);
    EXPECT_EQ(loop.proxy(), between);
    loop.subdivision().gain(0, SurfacePart::magnet).set(1.0);
    for (int i = 0; i < 100; ++i)
        loop.move(between);
    EXPECT_EQ(loop.proxy(), between);
}

TEST(SurfaceMagnets, AHeldProbeMovesNoBit) {
    for (const SteppingMethod method : kMethods) {
        for (const double mu : {0.0, 0.3}) {
            for (const bool inside : {true, false}) {
                SteppingSettings settings;
                settings.method = method;
                ContactLoop loop = on(ball(inside), magnetic(0.5, 1e-3, mu), settings);
                const double out = inside ? -1.0 : 1.0;
                for (const double h : {-1e-3, -1e-9, 0.0, 1e-9, 0.7e-3, 1e-3, 1.3e-3}) {
                    const Vec3 up{std::cos(0.1), std::sin(0.1), 0};
                    loop.start({kRadius + out * 0.5e-3, 0, 0});
                    for (int i = 0; i < 200; ++i)
                        loop.move((kRadius + out * h) * up);
                    const Vec3 held = loop.proxy();
                    for (int i = 0; i < 1000; ++i) {
                        loop.move((kRadius + out * h) * up);
                        ASSERT_EQ(loop.proxy(), held)
                            << i << " h " << h << " inside " << inside << " mu " << mu << " method "
                            << static_cast<int>(method);
                    }
                }
            }
        }
    }
}

// A plane and a ball that comes out of it: where both draw the proxy it is on the circle.
TEST(SurfaceMagnets, TheOrderOfTheSurfacesDoesNotMatter) {
    const auto loop_of = [](bool plane_first) {
        std::vector<std::unique_ptr<SurfaceContact>> surfaces;
        for (const bool plane : {plane_first, !plane_first}) {
            std::shared_ptr<const ScalarField> field =
                plane ? make_slab(2 * kTop) : make_solid_sphere(kRadius);
            surfaces.push_back(std::make_unique<VolumeContact>(field, LevelSettings{}));
        }
        return ContactLoop(precise(), std::move(surfaces), {}, 0.0,
                           {magnetic(1.0, 1e-3), magnetic(1.0, 1e-3)});
    };
    ContactLoop one = loop_of(true);
    ContactLoop other = loop_of(false);
    const double across = std::sqrt(kRadius * kRadius - kTop * kTop);
    one.start({across + 0.5e-3, 0, kTop + 0.3e-3});
    other.start({across + 0.5e-3, 0, kTop + 0.3e-3});
    for (int i = 0; i < 500; ++i) {
        const double angle = 5e-3 * i;
        const Vec3 probe = Vec3{0, 0, kTop + 0.5e-3} +
                           (across + 0.6e-3) * Vec3{std::cos(angle), std::sin(angle), 0};
        one.move(probe);
        other.move(probe);
        ASSERT_LE(glm::length(one.proxy() - other.proxy()), 1e-11) << i;
        const Vec3 expected{across * std::cos(angle), across * std::sin(angle), kTop};
        ASSERT_LE(glm::length(one.proxy() - expected), kWithin) << i;
    }
}

TEST(SurfaceMagnets, OfAVolumeTakesNoSample) {
    std::array<QueryCount, 2> counts;
    for (const bool drawn : {false, true}) {
        ContactLoop loop =
            on(make_sphere_cavity(kRadius), drawn ? magnetic(0.5, 1e-3) : SurfaceFinish{});
        loop.start({kRadius - 0.5e-3, 0, 0});
        for (int i = 0; i < 500; ++i)
            loop.move({kRadius - 0.5e-3 + 5e-6 * i, 0, 0});
        loop.move({kRadius + 2e-3, 0, 0});
        const QueryCount before = loop.surface(0).queries();
        for (int i = 0; i < 100; ++i)
            loop.move({kRadius + 2e-3, 0, 0});
        counts[drawn] = loop.surface(0).queries();
        counts[drawn].field_samples -= before.field_samples;
        counts[drawn].roots -= before.roots;
    }
    EXPECT_EQ(counts[0].field_samples, counts[1].field_samples);
    EXPECT_EQ(counts[0].roots, counts[1].roots);
    EXPECT_EQ(counts[1].field_samples, 100u); // one of each frame's only evaluation
}

// ---- meshes --------------------------------------------------------------------------------

TEST(SurfaceMagnets, OnAMeshPlaneThePullOffHeightIsExact) {
    const auto mesh = test::certified(test::sheet(0.06, 8));
    for (const double side : {1.0, -1.0}) {
        for (const SteppingMethod method : kMethods) {
            ContactLoop loop(precise(method), test::one_mesh(mesh), {}, 0.0, {magnetic(0.4, 2e-3)});
            const Vec3 start = mesh->scene().mesh().vertices[40];
            const auto near = mesh->scene().closest_point(start + Vec3(1e-3), 0.01);
            ASSERT_TRUE(near);
            const Vec3 n = side * near->normal;
            loop.start(near->position + 1e-3 * n);
            for (int i = 0; i <= 250; ++i) {
                const double h = 1e-5 * i;
                loop.move(near->position + h * n);
                if (i < 3) continue; // the first flies to the surface
                const Vec3 expected = near->position + std::max(0.0, h - 0.4 / kK) * n;
                ASSERT_LE(glm::length(loop.proxy() - expected), 1e-14) << i << " side " << side;
            }
        }
    }
}

// Round a body whose front is convex outside: over faces, edges and corners the proxy is the
// closest point.
TEST(SurfaceMagnets, RoundAConvexMeshTheProxyIsTheClosestPoint) {
    for (const TriangleMesh& mesh :
         {test::icosphere(kRadius, 3), test::box_mesh(Vec3(-0.01), Vec3(0.01))}) {
        ContactLoop loop(precise(), test::one_mesh(test::certified(mesh)), {}, 0.0,
                         {magnetic(1.0, 1e-3)});
        std::mt19937 random(4);
        Vec3 at = test::brute_closest_point(mesh, Vec3{0.1, 0.003, 0.002})->position;
        loop.start(at * 1.01);
        Vec3 heading = random_direction(random);
        for (int i = 0; i < 2000; ++i) {
            if (i % 100 == 0) heading = random_direction(random);
            // A place over the surface, moved on by 0.2 mm.
            at = test::brute_closest_point(mesh, at + 0.2e-3 * heading)->position;
            Vec3 probe = at + 0.5e-3 * glm::normalize(at);
            const auto nearest = test::brute_closest_point(mesh, probe);
            const SubdivisionResult result = loop.move(probe);
            ASSERT_LE(glm::length(loop.proxy() - nearest->position), kWithin)
                << i << " flags " << result.flags << " evaluations " << result.evaluations;
            if (i % 50 > 0) continue;
            loop.move(probe);
            const Vec3 held = loop.proxy();
            for (int frame = 0; frame < 20; ++frame) {
                loop.move(probe);
                ASSERT_EQ(loop.proxy(), held) << i;
            }
        }
    }
}

// From within, each facet has a nearest place of its own: the proxy is on one of them, and rests.
TEST(SurfaceMagnets, InAConcaveMeshTheProxyRestsOnAFacet) {
    const TriangleMesh mesh = test::icosphere(kRadius, 3);
    ContactLoop loop(precise(), test::one_mesh(test::certified(mesh)), {}, 0.0,
                     {magnetic(1.0, 1e-3)});
    loop.start({kRadius - 1e-3, 0, 0});
    for (int i = 0; i <= 1000; ++i) {
        const double angle = 0.005 * i;
        const Vec3 up{std::cos(angle), std::sin(angle) * 0.6, std::sin(angle) * 0.8};
        const Vec3 probe = (kRadius - 1e-3) * up;
        loop.move(probe);
        if (i == 0) continue;
        const auto under = test::brute_closest_point(mesh, loop.proxy());
        ASSERT_LE(glm::length(loop.proxy() - under->position), 1e-11) << i;
        // Facets are turned by up to 0.15 rad against each other, the probe is 1 mm off.
        ASSERT_LE(glm::length(loop.proxy() - kRadius * up), 0.3e-3) << i;
        const Vec3 held = loop.proxy();
        loop.move(probe);
        ASSERT_LE(glm::length(loop.proxy() - held), kWithin) << i;
    }
}

TEST(SurfaceMagnets, OnAGuardedSurfaceItIsTheVolumes) {
    std::shared_ptr<const ScalarField> field = make_solid_sphere(kRadius);
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    surfaces.push_back(std::make_unique<GuardedContact>(
        field, LevelSettings{}, test::certified(test::icosphere(kRadius, 5)), 0.5e-3));
    ContactLoop loop(precise(), std::move(surfaces), {}, 0.0, {magnetic(1.0, 1e-3)});
    loop.start({kRadius + 0.5e-3, 0, 0});
    for (int i = 0; i <= 300; ++i) {
        const double angle = 0.005 * i;
        const Vec3 up{std::cos(angle), std::sin(angle), 0};
        loop.move((kRadius + 1e-3) * up);
        ASSERT_LE(glm::length(loop.proxy() - kRadius * up), kWithin) << i;
    }
}

TEST(SurfaceMagnets, SettingsThatCannotBeAreRefused) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double inf = std::numeric_limits<double>::infinity();
    for (const SurfaceMagnet& bad :
         {SurfaceMagnet{-1.0, 1e-3}, {inf, 1e-3}, {nan, 1e-3}, {1.0, 0.0}, {1.0, inf}, {1.0, nan}})
        EXPECT_THROW(LoopMagnet{bad}, std::invalid_argument);
}

} // namespace
} // namespace palpate
