// SPDX-License-Identifier: Apache-2.0
// Soft surfaces through the whole loop: what is reported, recorded, saved and handed on.
#include <palpate/engine/loop/felt_surfaces.h>
#include <palpate/engine/loop/haptic_loop.h>

#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/record/recording.h>
#include <palpate/engine/record/trace_files.h>
#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/haptics/effects/constant_force.h>
#include <palpate/haptics/effects/point_guide.h>

#include "tests/engine/loop/soft_ball.h"
#include "tests/support/same_reports.h"
#include "tests/support/scripted_clock.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

using namespace test::soft_ball;

const std::string kAll = kSoft + "press_damping_n_s_per_m = 4\nstrength_n = 1.5\n";
const std::string kRough =
    "[[effect]]\ntype = \"friction\"\nsurface = \"liver\"\nstatic = 0.4\ndynamic = 0.3\n";

/// A hand that dips to 9 mm and drags, and leaves now and then.
DeviceState hand(int frame) {
    const double t = 1e-3 * frame;
    const double depth = 9e-3 * std::sin(3.0 * t);
    DeviceState state;
    state.time_s = t;
    state.position =
        (kRadius - depth) * glm::normalize(Vec3{0.3 * std::sin(2.0 * t), 0.2 * std::cos(t), 1.0});
    return state;
}

std::vector<FrameReport> frames(HapticLoop& loop, int first, int last) {
    std::vector<FrameReport> reports;
    for (int i = first; i < last; ++i)
        reports.push_back(loop.frame(hand(i)));
    return reports;
}

std::string difference(const std::vector<FrameReport>& a, const std::vector<FrameReport>& b) {
    for (std::size_t i = 0; i < a.size(); ++i)
        if (const std::string names = test::difference(a[i], b[i]); !names.empty())
            return "frame " + std::to_string(i) + ": " + names;
    return {};
}

TEST(SoftLoop, AFrameReportsTheTipTheFrontAndTheIndentation) {
    test::ScriptedClock clock;
    HapticLoop loop(ball(kSoft), clock);
    int pressed = 0;
    for (int i = 0; i < 4000; ++i) {
        const FrameReport frame = loop.frame(hand(i));
        const double behind_m = kRadius - glm::length(frame.probe);
        EXPECT_LE(glm::length(frame.force - kCoupling * (frame.proxy - frame.probe)), 1e-9);
        if (behind_m < 1e-6) {
            if (behind_m < -1e-6) {
                EXPECT_EQ(frame.indentation_m, 0.0);
            }
            continue;
        }
        ++pressed;
        EXPECT_NEAR(glm::length(frame.force), kStiffness * behind_m, 1e-6);
        EXPECT_NEAR(frame.indentation_m, behind_m * (1.0 - kStiffness / kCoupling), 1e-8);
        EXPECT_DOUBLE_EQ(frame.stiffness_n_per_m, kStiffness);
        EXPECT_NEAR(glm::length(place_on_surface(frame)), kRadius, 1e-9);
        EXPECT_EQ(frame.surfaces_felt, 1u);
    }
    EXPECT_GT(pressed, 1000);
}

TEST(SoftLoop, FramesAfterARestoreAreThoseAfterTheSave) {
    for (const SteppingMethod method : {SteppingMethod::adaptive, SteppingMethod::paper,
                                        SteppingMethod::fixed, SteppingMethod::single}) {
        const auto scene = ball(kAll, kRough);
        LoopDescription description;
        description.method = method;
        test::ScriptedClock clock(7.0);
        HapticLoop loop(scene, clock, description), another(scene, clock, description);
        for (int i = 0; i < 3000; ++i) {
            if (i == 900) {
                ASSERT_TRUE(loop.set_gain(0, 0.4));
            }
            loop.frame(hand(i));
            if (i % 450 != 449 && i != 910) continue;
            const LoopState state = loop.save();
            const auto first = frames(loop, i + 1, i + 200);
            loop.restore(state);
            EXPECT_EQ(difference(frames(loop, i + 1, i + 200), first), "") << i;
            another.restore(state);
            EXPECT_EQ(difference(frames(another, i + 1, i + 200), first), "") << i;
            loop.restore(state);
        }
    }
}

TEST(SoftLoop, ARecordingGivesTheSameFramesAgain) {
    const test::TemporaryFolder folder;
    const auto scene = ball(kAll, kRough);
    std::vector<DeviceState> inputs;
    for (int i = 0; i < 3000; ++i)
        inputs.push_back(hand(i));
    test::ScriptedClock clock(7.0);
    const Trace trace = run_trace(scene, inputs, clock);
    ASSERT_TRUE(presses_a_soft_surface(trace.frames));
    const Trace again = run_again(scene, trace);
    EXPECT_EQ(difference(again.frames, trace.frames), "");
    // The front is where a hard surface would hold the proxy: the audit is of it. It yields here,
    // so only frames before that are audited on the level.
    ASSERT_EQ(trace.audits.size(), 1u);
    EXPECT_GT(trace.audits[0].level_distance_m().size(), 100u);

    write_frames_csv(folder / "frames.csv", trace.frames, std::vector<std::string>{"liver"});
    const std::string csv = test::content_of(folder / "frames.csv");
    EXPECT_NE(csv.substr(0, csv.find('\n'))
                  .find("flags,felt,indentation_m,stiffness_n_per_m,front_x_m,front_y_m,front_z_m,"
                        "pressed"),
              std::string::npos);
}

/// Skin of 0.1 N/mm over bone that begins 10 mm beneath it.
std::shared_ptr<const Scene> skin_over_bone(const std::string& more = "") {
    return std::make_shared<const Scene>(
        parse_scene("[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n"
                    "[surface.skin]\nvolume = \"v\"\nstiffness_n_per_mm = 0.1\n"
                    "[surface.bone]\nvolume = \"v\"\niso_value = 0.01\n"
                    "[[effect]]\ntype = \"surface\"\nsurface = [\"skin\", \"bone\"]\n" +
                        more,
                    "bone.toml"));
}

TEST(SoftLoop, BoneIsFeltThroughSkinAndNeverPassed) {
    test::ScriptedClock clock;
    HapticLoop loop(skin_over_bone(), clock);
    ASSERT_EQ(felt_names(*skin_over_bone()), (std::vector<std::string>{"bone", "skin"}));
    int on_bone = 0;
    for (int i = 0; i < 3000; ++i) {
        DeviceState state = hand(i);
        const double behind_m = 16e-3 * std::sin(3e-3 * i); // skin alone lets the tip 80 % as deep
        state.position *= (kRadius - behind_m) / glm::length(state.position);
        const FrameReport frame = loop.frame(state);
        if (behind_m < 1e-6) continue;
        const double tip_m = std::max(40e-3, kRadius - 0.8 * behind_m);
        const double expected = kCoupling * (tip_m - (kRadius - behind_m));
        EXPECT_NEAR(glm::length(frame.force), std::min(expected, 5.0), 1e-3) << i;
        EXPECT_GE(glm::length(frame.proxy), 40e-3 - 1e-9);
        EXPECT_EQ(frame.pressed_surface, 1u);
        EXPECT_NEAR(glm::length(frame.front), kRadius, 1e-8);
        on_bone += frame.surfaces_felt == 3 ? 1 : 0;
        if (frame.surfaces_felt == 3) {
            const auto states = loop.surface_states();
            EXPECT_NEAR(states[0].depth_m, 0.0, 1e-7);
            EXPECT_NEAR(states[1].depth_m, 0.0, 1e-7); // the front's
        }
    }
    EXPECT_GT(on_bone, 300);
}

TEST(SoftLoop, LayersAreRecordedAuditedSavedAndRestored) {
    const auto scene = skin_over_bone(
        "[[effect]]\ntype = \"friction\"\nsurface = \"bone\"\nstatic = 0.4\ndynamic = 0.3\n");
    const auto deep = [](int i) {
        DeviceState state = hand(i);
        state.position *= (kRadius - 15e-3 * std::sin(3e-3 * i)) / glm::length(state.position);
        return state;
    };
    std::vector<DeviceState> inputs;
    for (int i = 0; i < 2000; ++i)
        inputs.push_back(deep(i));
    test::ScriptedClock clock(7.0);
    const Trace trace = run_trace(scene, inputs, clock);
    EXPECT_EQ(difference(run_again(scene, trace).frames, trace.frames), "");
    for (const SurfaceAudit& audit : trace.audits) {
        EXPECT_GT(audit.level_distance_m().size(), 100u) << audit.surface().name;
        for (const double distance : audit.level_distance_m())
            EXPECT_LE(std::abs(distance), 1e-7);
        EXPECT_LE(audit.deepest().depth_m, 25e-6);
        EXPECT_EQ(audit.frames_inside(), 0u);
    }
    HapticLoop loop(scene, clock), another(scene, clock);
    std::vector<FrameReport> first, again;
    for (int i = 0; i < 700; ++i)
        loop.frame(deep(i));
    const LoopState state = loop.save();
    another.restore(state);
    for (int i = 700; i < 1200; ++i) {
        first.push_back(loop.frame(deep(i)));
        again.push_back(another.frame(deep(i)));
    }
    EXPECT_EQ(difference(again, first), "");
}

// An effect of the program's own may hold the tip: then that is solved, and not eliminated.
TEST(SoftLoop, AnEffectOfTheProgramsOwnActsOnTheTip) {
    test::ScriptedClock clock;
    std::vector<std::unique_ptr<Effect>> custom;
    custom.push_back(
        std::make_unique<PointGuide>(Vec3{0, 0, kRadius - 3e-3}, GuideSettings{100.0, 5e-3}));
    HapticLoop loop(ball(kSoft), clock, std::move(custom));
    DeviceState state;
    state.position = {0, 0, kRadius + 1e-4};
    loop.frame(state);
    state.position = {0, 0, kRadius - 3e-3};
    const FrameReport frame = loop.frame(state);
    EXPECT_LE(glm::length(frame.proxy - state.position), 1e-9); // nothing is left for the coupling
}

// What a loop has besides the scene is refused in the words in which a scene is: by the surface's
// name, and with what to do.
TEST(SoftLoop, WhatALoopOfItsOwnCannotDoIsRefusedInTheWordsOfAScene) {
    test::ScriptedClock clock;
    const auto why = [&](const std::shared_ptr<const Scene>& scene, SteppingMethod method,
                         bool is_guided) -> std::string {
        LoopDescription loop;
        loop.method = method;
        std::vector<std::unique_ptr<Effect>> custom;
        if (is_guided)
            custom.push_back(
                std::make_unique<PointGuide>(Vec3{0, 0, kRadius}, GuideSettings{1.0, 5e-3}));
        try {
            HapticLoop(scene, clock, loop, std::move(custom));
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return {};
    };
    EXPECT_EQ(why(skin_over_bone(), SteppingMethod::adaptive, true), "");
    EXPECT_EQ(why(skin_over_bone(), SteppingMethod::fixed, false),
              "effects[0].surface = \"skin\" is soft, and not all that is felt: then the method "
              "cannot be fixed; take method = \"adaptive\", or make it hard: stiffness_n_per_mm = "
              "inf");
    EXPECT_EQ(why(ball(kSoft), SteppingMethod::fixed, false), "");
    EXPECT_NE(why(ball(kSoft), SteppingMethod::fixed, true).find("the method cannot be fixed"),
              std::string::npos);
    EXPECT_EQ(why(ball(kAll), SteppingMethod::adaptive, false), "");
    EXPECT_NE(why(ball(kAll), SteppingMethod::adaptive, true)
                  .find("effects[0].surface = \"liver\" is soft, and not all that is felt: then it "
                        "cannot yield (strength_n = 1.5)"),
              std::string::npos);
    EXPECT_NE(why(ball(kSoft, kRough), SteppingMethod::adaptive, true).find("it cannot rub"),
              std::string::npos);
}

// A force of no sense leads the tip, and the front with it, to where no scene reaches: the next
// frame goes on from where both were.
TEST(SoftLoop, AFrameThatLeadsNowhereLeavesTheFrontWhereItWas) {
    for (const std::string& keys : {kSoft, std::string()}) {
        test::ScriptedClock clock;
        std::vector<std::unique_ptr<Effect>> custom;
        custom.push_back(std::make_unique<ConstantForce>(Vec3{0, 0, 2.5e9}));
        HapticLoop loop(ball(keys), clock, std::move(custom));
        ASSERT_TRUE(loop.set_gain(1, 0.0));
        DeviceState state;
        state.position = {0, 0, kRadius + 5e-3};
        const Vec3 held = loop.frame(state).proxy;
        ASSERT_TRUE(loop.set_gain(1, 1.0));
        FrameReport frame;
        for (int i = 0; i < 60; ++i)
            frame = loop.frame(state);
        EXPECT_TRUE(frame.flags & kForceNotFinite);
        EXPECT_LT(glm::length(frame.proxy), 1e6);
        if (!keys.empty()) {
            EXPECT_LT(glm::length(frame.front), 1e6);
        }
        ASSERT_TRUE(loop.set_gain(1, 0.0));
        for (int i = 0; i < 60; ++i)
            frame = loop.frame(state);
        EXPECT_NEAR(glm::length(frame.proxy - held), 0.0, 1e-9);
    }
}

// A device that bears less than the scene's coupling gets a softer one: what the hand feels stays.
TEST(SoftLoop, BehindASofterCouplingTheHandFeelsTheSame) {
    test::ScriptedClock clock;
    DeviceProperties device;
    device.force_n = 8.0;
    device.stiffness_n_per_m = 300.0;
    device.damping_n_s_per_m = 5.0;
    const auto scene = ball(kSoft);
    HapticLoop loop(scene, clock, scene->description().loop, device);
    ASSERT_LT(loop.coupling().stiffness, kCoupling);
    ASSERT_GT(loop.coupling().stiffness, kStiffness);
    DeviceState state;
    FrameReport frame;
    for (int i = 0; i < 6000; ++i) {
        state.time_s = 1e-3 * i;
        state.position = {0, 0, kRadius + 1e-3 - std::min(5e-3, 1e-6 * i)};
        frame = loop.frame(state);
    }
    EXPECT_NEAR(frame.force.z, kStiffness * 4e-3, 0.02);
    EXPECT_NEAR(frame.indentation_m, 4e-3 * (1.0 - kStiffness / loop.coupling().stiffness), 1e-4);
}

} // namespace
} // namespace palpate
