// SPDX-License-Identifier: Apache-2.0
// What a loop's embedder may change while it runs, and adds of his own.
#include <algorithm>
#include <atomic>
#include <limits>
#include <string>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/haptics/effects/constant_force.h>

#include "tests/support/scripted_clock.h"

namespace palpate {
namespace {

using testing::HasSubstr;

constexpr const char* kBalls = "[volume.ball]\nanalytic = \"solid_sphere\"\nradius_mm = 20\n"
                               "[surface.a]\nvolume = \"ball\"\niso_value = 0\n[surface.b]\nvolume "
                               "= \"ball\"\niso_value = 0.019\n"
                               "[limits]\nslew_n_per_s = 1e6\n";
std::string surface(const std::string& name) {
    return "[[effect]]\ntype = \"surface\"\nsurface = \"" + name + "\"\n";
}
std::string weight(const std::string& force_n) {
    return "[[effect]]\ntype = \"constant_force\"\nforce_n = " + force_n + "\n";
}

std::shared_ptr<const Scene> scene(const std::string& text) {
    return std::make_shared<const Scene>(parse_scene(text, "x.toml"));
}

Vec3 force(HapticLoop& loop, const Vec3& probe) {
    DeviceState state;
    state.position = probe;
    for (int frame = 0; frame < 120; ++frame) // longer than a ramp from 2 to 0
        loop.frame(state);
    return loop.frame(state).force;
}

// Its force is part of what a workspace limits.
TEST(LiveGain, AWorkspaceHoldsWhatACustomEffectDraws) {
    const std::string box = "[[effect]]\ntype = \"workspace\"\nbox_mm = [[-20, -20, -20], [20, 20, "
                            "20]]\n";
    test::ScriptedClock clock;
    std::vector<std::unique_ptr<Effect>> custom;
    custom.push_back(std::make_unique<ConstantForce>(Vec3{5, 0, 0}));
    HapticLoop loop(scene(weight("[0, 0, 0]") + box), clock, std::move(custom));
    ASSERT_EQ(loop.effect_count(), 3u);
    const Vec3 inside{0.018, 0, 0};
    EXPECT_LE(glm::length(force(loop, inside) - 500.0 * Vec3{0.002, 0, 0}), 1e-12);
    EXPECT_TRUE(loop.set_gain(2, 0.0)); // the custom one
    EXPECT_EQ(force(loop, inside), Vec3{0.0});
    EXPECT_TRUE(loop.set_gain(2, 1.0));
    EXPECT_TRUE(loop.set_gain(1, 0.0)); // the box
    EXPECT_LE(glm::length(force(loop, inside) - Vec3{5, 0, 0}), 1e-12);
}

// Else the hand would come to what was never built.
TEST(LiveGain, AWorkspaceThatKeepsFromASurfaceStaysAsItIs) {
    const std::string box =
        "[[effect]]\ntype = \"workspace\"\nbox_mm = [[100, -20, -20], [120, 20, "
        "20]]\n";
    test::ScriptedClock clock;
    HapticLoop loop(scene(kBalls + surface("a") + box), clock);
    EXPECT_FALSE(loop.set_gain(0, 0.5)); // out of reach: left out
    EXPECT_FALSE(loop.set_gain(1, 0.9));
    EXPECT_TRUE(loop.set_gain(1, 1.0));
}

// A hand that went on while nobody heard of it has struck nothing.
TEST(LiveGain, AContactMadeInSilenceDoesNotRing) {
    const auto plate =
        scene("[volume.p]\nanalytic = \"slab\"\nthickness_mm = 20\n[surface.b]\nvolume "
              "= \"p\"\n[limits]\nslew_n_per_s = 1e6\n" +
              surface("b") + "[[effect]]\ntype = \"vibration\"\n");
    test::ScriptedClock clock;
    HapticLoop loop(plate, clock);
    double rings_n = 0.0, felt_n = 0.0;
    for (int i = 0; i < 400; ++i) { // 5 mm/s, into the plate at frame 100
        DeviceState state;
        state.time_s = 1e-3 * i;
        state.position = {0, 0, 0.0105 - 5e-6 * std::min(i, 200)};
        if (i >= 20 && i < 150) state.freshness = Freshness::stale;
        const FrameReport report = loop.frame(state);
        if (report.flags != 0) continue;
        const Vec3 spring = 500.0 * (report.proxy - state.position);
        rings_n = std::max(rings_n, glm::length(report.force - spring));
        felt_n = std::max(felt_n, glm::length(spring));
    }
    EXPECT_LE(rings_n, 1e-12);
    EXPECT_NEAR(felt_n, 500.0 * 0.5e-3, 1e-9);
}

// Effects count in the scene's order, surfaces in their own by name, and what is left out counts,
// too.
TEST(LiveGain, ActsOnTheEffectOfThatNumberAlone) {
    const auto one = scene(kBalls + surface("b") + weight("[0, 0, 0]") + weight("[1, 0, 0]") +
                           surface("b") + surface("a") + weight("[0, 1, 0]"));
    test::ScriptedClock clock;
    std::vector<std::unique_ptr<Effect>> custom;
    custom.push_back(std::make_unique<ConstantForce>(Vec3{0, 0, 1}));
    HapticLoop loop(one, clock, std::move(custom));
    ASSERT_EQ(loop.effect_count(), 7u);
    const Vec3 outside{0.03, 0, 0};
    EXPECT_LE(glm::length(force(loop, outside) - Vec3{1, 1, 1}), 1e-12);
    EXPECT_FALSE(loop.set_gain(1, 0.5)); // cannot be felt: left out
    EXPECT_FALSE(loop.set_gain(3, 0.5)); // felt already: left out
    EXPECT_TRUE(loop.set_gain(2, 0.5));
    EXPECT_TRUE(loop.set_gain(5, 2.0));
    EXPECT_TRUE(loop.set_gain(6, 0.0));
    EXPECT_LE(glm::length(force(loop, outside) - Vec3{0.5, 2, 0}), 1e-12);
    EXPECT_TRUE(loop.set_gain(2, 0.0));
    EXPECT_TRUE(loop.set_gain(5, 0.0));
    // Surface b is a ball of 1 mm in the middle, not met here.
    const Vec3 pressed{0.018, 0, 0};
    EXPECT_NEAR(force(loop, pressed).x, 1.0, 1e-4); // 2 mm at 500 N/m; tolerance 0.1 um
    EXPECT_TRUE(loop.set_gain(0, 0.0));
    EXPECT_NEAR(force(loop, pressed).x, 1.0, 1e-4);
    EXPECT_TRUE(loop.set_gain(4, 0.0));
    EXPECT_LE(glm::length(force(loop, pressed)), 1e-12);
}

TEST(LiveGain, WhatIsNoGainOrNoEffectChangesNothing) {
    test::ScriptedClock clock;
    HapticLoop loop(scene(weight("[1, 0, 0]")), clock);
    for (const double gain : {-0.1, 10.5, std::numeric_limits<double>::quiet_NaN()})
        EXPECT_FALSE(loop.set_gain(0, gain));
    EXPECT_FALSE(loop.set_gain(1, 0.5));
    EXPECT_NEAR(force(loop, Vec3{0.0}).x, 1.0, 1e-12);
}

// The same gains before the same frames: the same bits.
TEST(LiveGain, RepeatsItselfFrameByFrame) {
    const auto one = scene(kBalls + surface("a") + weight("[1, 0, 0]"));
    std::vector<Vec3> forces;
    for (int run = 0; run < 2; ++run) {
        test::ScriptedClock clock;
        HapticLoop loop(one, clock);
        for (int frame = 0; frame < 300; ++frame) {
            if (frame % 37 == 5) loop.set_gain(frame % 2, 0.01 * (frame % 150));
            DeviceState state;
            state.position = {0.021 - 1e-5 * frame, 1e-5 * frame, 0};
            const Vec3 force_n = loop.frame(state).force;
            if (run == 0)
                forces.push_back(force_n);
            else
                EXPECT_EQ(force_n, forces[frame]) << frame;
        }
    }
}

// Another thread may do so at any time; whatever a frame sees, it is a force between the two.
TEST(LiveGain, MayBeSetFromAnotherThread) {
    test::ScriptedClock clock;
    HapticLoop loop(scene(weight("[1, 0, 0]")), clock);
    std::atomic<bool> done{false};
    std::thread other([&] {
        for (int i = 0; !done; ++i)
            loop.set_gain(0, i % 2);
    });
    double before_n = 0.0;
    for (int frame = 0; frame < 20000; ++frame) {
        const double force_n = loop.frame({}).force.x;
        ASSERT_GE(force_n, -1e-12);
        ASSERT_LE(force_n, 1.0 + 1e-12);
        if (frame > 0) {
            ASSERT_LE(std::abs(force_n - before_n), 0.02 + 1e-12);
        }
        before_n = force_n;
    }
    done = true;
    other.join();
}

TEST(LiveGain, ARecordingOfChangedGainsIsNotReplayed) {
    Recording recording;
    recording.scene_text = weight("[1, 0, 0]");
    recording.scene_file = "/x.toml";
    recording.overrides = "{}";
    recording.frames.resize(2);
    recording.inputs.resize(2);
    recording.frames[1].frame = 1;
    EXPECT_NO_THROW(recorded_scene(recording, "r.h5", {}));
    recording.frames[1].flags = kLiveGain;
    try {
        recorded_scene(recording, "r.h5", {});
        FAIL() << "it was accepted";
    } catch (const std::runtime_error& error) {
        EXPECT_THAT(error.what(), HasSubstr("r.h5: frame 1 had an effect whose gain was changed"));
    }
    recording.frames[1].flags = kBodyMoved;
    EXPECT_THROW(recorded_scene(recording, "r.h5", {}), std::runtime_error);
    recording.frames[1].flags = kSceneAdopted;
    EXPECT_THROW(recorded_scene(recording, "r.h5", {}), std::runtime_error);
}

TEST(RecordedScene, PartsThatDoNotBelongTogetherAreRefused) {
    Recording whole;
    whole.scene_text = weight("[1, 0, 0]");
    whole.scene_file = "/x.toml";
    whole.overrides = "{}";
    whole.frames.resize(2);
    whole.inputs.resize(2);
    whole.frames[1].frame = 1;
    whole.frames[1].evaluations = 3;
    whole.steps_left = {2, 1, 0};
    EXPECT_NO_THROW(recorded_scene(whole, "r.h5", {}));
    Recording without_input = whole;
    without_input.inputs.pop_back();
    Recording without_step = whole;
    without_step.steps_left.pop_back();
    for (const Recording& broken : {without_input, without_step})
        try {
            recorded_scene(broken, "r.h5", {});
            FAIL() << "it was accepted";
        } catch (const std::runtime_error& error) {
            EXPECT_THAT(error.what(), HasSubstr("r.h5: its inputs, frames and clock do not belong "
                                                "together; record again"));
        }
}

} // namespace
} // namespace palpate
