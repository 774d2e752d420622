// SPDX-License-Identifier: Apache-2.0
// A held probe comes to rest, whatever acts, and what moves slowly is not taken for rest.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/haptics/stepping/frame_flags.h>

#include "tests/support/contact_kinds.h"
#include "tests/support/contact_loop.h"
#include "tests/support/effect_lists.h"
#include "tests/support/held_scenes.h"
#include "tests/support/random_scenes.h"
#include "tests/support/scene_texts.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

// Calming takes some 700 frames at most: a factor of 10^6 by 2 % in each.
constexpr int kFrames = 1600;
constexpr int kRestBy = 1200;

void expect_rest(std::uint64_t seed, SteppingMethod method) {
    test::HeldScene scene = test::HeldSceneDraw(seed).scene(method);
    test::ScriptedClock clock(100.0);
    const test::HeldEnd end = test::hold(scene, kFrames, clock);
    EXPECT_LE(end.last_moved, kRestBy)
        << "seed " << seed << ": " << scene.words << "moves by " << end.last_way_m << " m a frame";
}

TEST(HeldProbe, ComesToRestToTheBitInAnyMixOfEffects) {
    for (std::uint64_t seed = 0; seed < 100; ++seed)
        expect_rest(seed, SteppingMethod::adaptive);
}

TEST(HeldProbe, ComesToRestWithAnyMethod) {
    for (const SteppingMethod method :
         {SteppingMethod::single, SteppingMethod::fixed, SteppingMethod::paper})
        for (std::uint64_t seed = 0; seed < 25; ++seed)
            expect_rest(seed, method);
}

// Two faces of a notch, of which an evaluation finds one: the other is remembered from the frame
// before, and both hold the proxy in the edge.
TEST(HeldProbe, OneEvaluationAFrameInANotchRestsInItsEdge) {
    test::ContactLoop loop(test::stepping(SteppingMethod::single),
                           test::one_surface(make_wedge(240.0)));
    loop.start({0, 0, 5e-3});
    std::uint32_t flags = 0;
    int last_moved = 0;
    for (int i = 0; i < kFrames; ++i) {
        const Vec3 before = loop.proxy();
        flags |= loop.move({0.3e-3, 0, -4e-3}).flags;
        if (!(loop.proxy() == before)) last_moved = i;
    }
    EXPECT_LE(last_moved, kRestBy);
    EXPECT_EQ(flags, 0u);
    EXPECT_LE(std::hypot(loop.proxy().x, loop.proxy().z), 1e-12);
}

// Where every voxel is another number, planes of a frame need not be those of the next, and no
// frame need end where it began. Seen: between voxels of 3 mm the proxy went to and fro by 0.2 mm.
TEST(HeldProbe, OnNoiseOneSurfaceComesToRestAndSaysSo) {
    constexpr double kVoxel = 3e-3, kHalf = 12e-3;
    int calmed = 0;
    for (std::uint64_t seed = 0; seed < 60; ++seed) {
        test::Random random(seed);
        const auto noise = test::voxels_of(
            [&](const Vec3&) { return test::between(random, -1e-3, 1e-3); }, kHalf, kVoxel);
        test::ContactLoop loop({}, test::one_surface(noise));
        const Vec3 begin = test::any_vector(random, 1.5 * kHalf);
        const Vec3 probe = test::any_vector(random, 0.5 * kHalf);
        loop.start(begin);
        for (int i = 1; i <= 40; ++i)
            loop.move(begin + (i / 40.0) * (probe - begin));
        std::uint32_t flags = 0;
        int last_moved = 0;
        for (int i = 0; i < kFrames; ++i) {
            const Vec3 before = loop.proxy();
            flags |= loop.move(probe).flags;
            if (!(loop.proxy() == before)) last_moved = i;
        }
        EXPECT_LE(last_moved, kRestBy) << "seed " << seed;
        calmed += (flags & kCalmed) != 0;
    }
    EXPECT_GT(calmed, 0) << "the noise must be one that does not rest by itself";
}

// e' = e g / (k + g) in each frame, g = b / T, down to a thousandth of the loop's tolerance a
// frame.
TEST(HeldProbe, AViscousCreepGoesOnToItsEnd) {
    constexpr double kDamping = 100.0; // N s/m: 0.5 % of the way a frame
    constexpr double kSpring = kDamping / 1e-3;
    constexpr double kStays = kSpring / (test::ContactLoop::kStiffness + kSpring);
    for (const SteppingMethod method : {SteppingMethod::fixed, SteppingMethod::adaptive}) {
        test::ContactLoop loop(test::stepping(method), {},
                               test::effects(std::make_unique<Viscosity>(kDamping)));
        loop.start(Vec3{0.0});
        double behind_m = 1e-3;
        for (int i = 0; behind_m > 1e-8; ++i) {
            const std::uint32_t flags = loop.move({1e-3, 0, 0}).flags;
            behind_m *= kStays;
            ASSERT_NEAR(1e-3 - loop.proxy().x, behind_m, 1e-6 * behind_m + 1e-14) << i;
            ASSERT_EQ(flags, 0u) << i;
        }
    }
}

// A probe that goes on by nanometres is not held: the proxy follows, within the tolerance.
TEST(HeldProbe, ANanometreAFrameIsFollowed) {
    test::ContactLoop loop({}, test::one_surface(make_slab(20e-3)),
                           test::effects(std::make_unique<ConstantForce>(Vec3{0.1, 0, 0}),
                                         std::make_unique<Viscosity>(0.1)));
    loop.start({0, 0, 0.0101});
    Vec3 probe{0, 0, 9e-3};
    for (int i = 0; i < 200; ++i)
        loop.move(probe);
    const double before = loop.proxy().x;
    for (int i = 0; i < 3000; ++i)
        loop.move(probe += Vec3{1e-9, 0, 0});
    EXPECT_NEAR(loop.proxy().x - before, 3e-6, 2e-7);
}

// What does not come to rest by itself is said: the flag that calms it.
TEST(HeldProbe, WhatIsCalmedIsFlagged) {
    int calmed = 0;
    for (std::uint64_t seed = 0; seed < 100; ++seed) {
        test::HeldScene scene = test::HeldSceneDraw(seed).scene();
        test::ScriptedClock clock(100.0);
        calmed += (test::hold(scene, 400, clock).flags & kCalmed) != 0;
    }
    EXPECT_GT(calmed, 0);
    EXPECT_LT(calmed, 30) << "most come to rest by themselves";
}

/// Whether a frame of this scene is one problem, which does not change where its solution is:
/// surfaces, friction, magnets, guides and workspaces. Effects of a field without a level take the
/// field where the frame begins, so each frame is another problem; a medium holds back.
bool is_one_problem(const std::string& scene) {
    constexpr std::array others{"gradient_surface", "gradient_force", "vector_force",
                                "vector_follow",    "fibre_follow",   "front_shape",
                                "vortex",           "viscosity",      "strength_n = [["};
    return std::none_of(others.begin(), others.end(),
                        [&](const char* other) { return scene.find(other) != std::string::npos; });
}

// A frame without a flag has found its balance: the next one, with the probe held, stays within the
// tolerance. Not where the end of a frame changes the problem: a magnet catches, friction breaks
// away, a yielding surface has been pushed in. All that is counted here, too.
TEST(HeldProbe, AFrameThatHasFoundItsBalanceIsFollowedByOneThatStays) {
    constexpr std::uint32_t kSaid =
        kEvaluationCap | kStalled | kSolverCap | kCalmed | kPrimitivesFull;
    const test::TemporaryFolder folder;
    test::SceneTextDraw::make_meshes(folder.path());
    int balanced = 0, left = 0, far = 0;
    for (std::uint64_t seed = 0; seed < 1500; ++seed) {
        test::SceneTextDraw draw(seed);
        const std::string text = draw.text();
        if (text.find("\"adaptive\"") == std::string::npos || !is_one_problem(text)) continue;
        const auto scene =
            std::make_shared<const Scene>(parse_scene(text, folder.path() / "scene.toml"),
                                          SceneResources{.files = scene_files()});
        const LoopDescription& settings = scene->description().loop;
        test::ScriptedClock clock(7.0);
        HapticLoop loop(scene, clock);
        DeviceState state;
        for (const Vec3& probe : draw.way(200)) {
            state.position = probe;
            state.time_s += 1.0 / settings.rate_hz;
            const FrameReport report = loop.frame(state);
            if (report.flags & kSaid) continue;
            ++balanced;
            const LoopState before = loop.save();
            DeviceState held = state;
            held.time_s += 1.0 / settings.rate_hz;
            const double way_um = 1e6 * glm::length(loop.frame(held).proxy - report.proxy);
            left += way_um > settings.tolerance_um;
            far += way_um > 100.0 * settings.tolerance_um;
            loop.restore(before);
        }
    }
    EXPECT_GT(balanced, 30000);
    EXPECT_LT(left, balanced / 1000) << "of " << balanced;
    EXPECT_LT(far, balanced / 1500) << "of " << balanced;
    RecordProperty("balanced", balanced);
    RecordProperty("left", left);
}

} // namespace
} // namespace palpate
