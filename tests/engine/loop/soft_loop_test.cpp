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

#include "tests/support/same_reports.h"
#include "tests/support/scripted_clock.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

constexpr double kRadius = 50e-3;    // m
constexpr double kStiffness = 200.0; // N/m
constexpr double kCoupling = 500.0;  // N/m

std::shared_ptr<const Scene> ball(const std::string& keys, const std::string& more = "") {
    return std::make_shared<const Scene>(parse_scene(
        "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n[surface.liver]\nvolume = "
        "\"v\"\n" +
            keys + "[[effect]]\ntype = \"surface\"\nsurface = \"liver\"\n" + more,
        "ball.toml"));
}

const std::string kSoft = "stiffness_n_per_mm = 0.2\n";
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

// One that goes on is felt as before; one that was hard before goes on from its front.
TEST(SoftLoop, AnotherSceneGoesOnFromTheFront) {
    for (const auto& [before, after] : {std::pair{kSoft, kSoft}, std::pair{kSoft, std::string()},
                                        std::pair{std::string(), kSoft}}) {
        test::ScriptedClock clock;
        HapticLoop loop(ball(before), clock);
        DeviceState state;
        for (const double depth : {-1e-3, 5e-3, 5e-3}) {
            state.position = {0, 0, kRadius - depth};
            loop.frame(state);
        }
        loop.adopt(ball(after));
        const FrameReport frame = loop.frame(state);
        EXPECT_FALSE(frame.flags & kInsideAtStart);
        const double expected = (after.empty() ? kCoupling : kStiffness) * 5e-3;
        EXPECT_NEAR(frame.force.z, expected, 1e-6) << before << " -> " << after;
    }
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

/// The same skin and bone, as a scene in which each may be hard, soft or not there.
std::shared_ptr<const Scene> layers(const std::string& skin_keys, bool with_skin, bool with_bone) {
    std::string text = "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n";
    if (with_skin) text += "[surface.skin]\nvolume = \"v\"\n" + skin_keys;
    if (with_bone) text += "[surface.bone]\nvolume = \"v\"\niso_value = 0.01\n";
    for (const auto& [name, is_there] : {std::pair{"skin", with_skin}, {"bone", with_bone}})
        if (is_there)
            text += std::string("[[effect]]\ntype = \"surface\"\nsurface = \"") + name + "\"\n";
    return std::make_shared<const Scene>(parse_scene(text, "layers.toml"));
}

// The tip is in the tissue, far behind the skin: what holds the proxy from now on does so at the
// front, and not where the tip happens to be.
TEST(SoftLoop, AnotherSceneGoesOnFromTheFrontOfALayer) {
    const std::string soft_keys = "stiffness_n_per_mm = 0.1\n";
    constexpr double kSkin = 100.0, kDepth = 5e-3;
    struct Case {
        std::shared_ptr<const Scene> after;
        double force_n;
    };
    for (const auto& [after, force_n] :
         {Case{layers(soft_keys, true, false), kSkin * kDepth}, // alone
          Case{layers("", true, false), kCoupling * kDepth},    // hard, and alone
          Case{layers("", true, true), kCoupling * kDepth},     // hard, over the bone
          Case{layers(soft_keys, true, true), kSkin * kDepth},
          Case{layers("", false, true), 0.0}}) {
        test::ScriptedClock clock;
        HapticLoop loop(layers(soft_keys, true, true), clock);
        DeviceState state;
        for (const double depth : {-1e-3, kDepth, kDepth}) {
            state.position = {0, 0, kRadius - depth};
            loop.frame(state);
        }
        loop.adopt(after);
        const FrameReport frame = loop.frame(state);
        EXPECT_FALSE(frame.flags & kInsideAtStart) << force_n;
        EXPECT_NEAR(frame.force.z, force_n, 1e-4) << after->surfaces().size();
        const bool still_touched = force_n > 0.0;
        ASSERT_EQ(loop.touches().size(), still_touched ? 1u : 0u);
        if (still_touched) {
            EXPECT_EQ(loop.touches()[0].phase, Touch::Phase::goes_on);
        }
        EXPECT_NEAR(loop.frame(state).force.z, force_n, 1e-4);
    }
}

// The same where the tip lies on bone that holds it: on its level, or behind it by rounding. Such a
// surface was asked for the way before it had looked, and said that there was none.
TEST(SoftLoop, AnotherSceneGoesOnFromTheFrontWhereTheTipLiesOnBone) {
    const auto skin_over_bone_in_cavity = [](const std::string& keys) {
        return std::make_shared<const Scene>(
            parse_scene("[volume.skin]\nanalytic = \"sphere_cavity\"\nradius_mm = 40\n"
                        "[volume.bone]\nanalytic = \"sphere_cavity\"\nradius_mm = 43\n"
                        "[surface.skin]\nvolume = \"skin\"\n" +
                            keys +
                            "[surface.bone]\nvolume = \"bone\"\n"
                            "[[effect]]\ntype = \"surface\"\nsurface = [\"skin\", \"bone\"]\n",
                        "cavity.toml"));
    };
    const auto after = skin_over_bone_in_cavity("");
    for (int slid = 1; slid <= 20; ++slid) {
        test::ScriptedClock clock;
        HapticLoop loop(skin_over_bone_in_cavity("stiffness_n_per_mm = 0.1\n"), clock);
        DeviceState state;
        FrameReport frame;
        for (int i = -50; i <= slid; ++i) {
            const double angle = 5e-3 * std::max(0, i);
            const double radius = 46e-3 - 0.2e-3 * std::max(0, -i);
            state.position = radius * Vec3{std::sin(angle), 0.0, std::cos(angle)};
            frame = loop.frame(state);
        }
        ASSERT_EQ(frame.surfaces_felt, 3u) << slid;
        loop.adopt(after);
        frame = loop.frame(state);
        EXPECT_FALSE(frame.flags & kInsideAtStart) << slid;
        EXPECT_NEAR(glm::length(frame.proxy), 40e-3, 1e-6) << slid;
    }
}

// Nothing of a hand that holds still changes where the same tissue is felt in another scene: its
// damper goes on from how far it was pressed in, and the coupling's sees no velocity.
TEST(SoftLoop, DampersGoOnInAnotherScene) {
    const std::string surface = "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n"
                                "[surface.skin]\nvolume = \"v\"\nstiffness_n_per_mm = 0.2\n"
                                "press_damping_n_s_per_m = 4\n"
                                "[[effect]]\ntype = \"surface\"\nsurface = \"skin\"\n";
    const std::string bone = "[surface.bone]\nvolume = \"v\"\niso_value = 0.03\n"
                             "[[effect]]\ntype = \"surface\"\nsurface = \"bone\"\n";
    const std::string damped = "[coupling]\ndamping_n_s_per_m = 2\n";
    const auto scene = [](const std::string& text) {
        return std::make_shared<const Scene>(parse_scene(text, "dampers.toml"));
    };
    for (const std::string& coupling : {std::string(), damped})
        for (const auto& [before, after] : {std::pair{surface, surface},
                                            {surface, surface + bone},
                                            {surface + bone, surface},
                                            {surface + bone, surface + bone}})
            for (const bool is_late : {false, true}) {
                test::ScriptedClock clock;
                HapticLoop loop(scene(coupling + before), clock);
                DeviceState state;
                FrameReport frame;
                for (int i = 0; i < 400; ++i) {
                    state.position = {0, 0, kRadius + 1e-3 - 10e-3 * std::min(1.0, i / 100.0)};
                    frame = loop.frame(state);
                }
                ASSERT_NEAR(frame.force.z, 1.8, 1e-3);
                const Vec3 there = frame.proxy;
                loop.adopt(scene(coupling + after));
                if (is_late) { // the tip stays
                    DeviceState late = state;
                    late.freshness = Freshness::stale;
                    EXPECT_NEAR(glm::length(loop.frame(late).proxy - there), 0.0, 1e-6);
                }
                for (int i = 0; i < 5; ++i) {
                    frame = loop.frame(state);
                    EXPECT_NEAR(frame.force.z, 1.8, 1e-3)
                        << coupling.size() << ' ' << before.size() << " -> " << after.size() << ' '
                        << is_late << ' ' << i;
                }
            }
}

// Effects that are new hold the tip where it is, not where the front is, also where the surface is
// gone.
TEST(SoftLoop, NewEffectsBeginAtTheTip) {
    const std::string ball = "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n";
    const std::string skin = "[surface.skin]\nvolume = \"v\"\nstiffness_n_per_mm = 0.2\n"
                             "[[effect]]\ntype = \"surface\"\nsurface = \"skin\"\n";
    const std::string medium = "[[effect]]\ntype = \"viscosity\"\ndamping_n_s_per_m = 10\n";
    const auto scene = [&](const std::string& text) {
        return std::make_shared<const Scene>(parse_scene(ball + text, "tip.toml"));
    };
    for (const std::string& after : {skin + medium, medium}) {
        test::ScriptedClock clock;
        HapticLoop loop(scene(skin), clock);
        DeviceState state;
        FrameReport frame;
        for (int i = 0; i < 200; ++i) {
            state.position = {0, 0, kRadius + 1e-3 - 10e-3 * std::min(1.0, i / 100.0)};
            frame = loop.frame(state);
        }
        ASSERT_NEAR(frame.force.z, 1.8, 1e-6);
        const Vec3 tip = frame.proxy;
        loop.adopt(scene(after));
        for (int i = 0; i < 5; ++i) {
            frame = loop.frame(state);
            EXPECT_LE(frame.force.z, 1.8 + 1e-6) << after << i;
            if (after != medium) {
                EXPECT_NEAR(glm::length(frame.proxy - tip), 0.0, 1e-6) << i;
            }
        }
    }
}

// A new bone, between the tip and the front: it is passed by nobody, and the skin is not felt until
// the hand has left it.
TEST(SoftLoop, WhereTheWayToTheFrontIsBarredTheTipStays) {
    const auto skin_and_lid = [](const std::string& keys) {
        return std::make_shared<const Scene>(
            parse_scene("[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n"
                        "[surface.skin]\nvolume = \"v\"\n" +
                            keys +
                            "[surface.cavity]\nvolume = \"c\"\n"
                            "[volume.c]\nanalytic = \"sphere_cavity\"\nradius_mm = 48\n"
                            "[[effect]]\ntype = \"surface\"\nsurface = [\"skin\", \"cavity\"]\n",
                        "lid.toml"));
    };
    test::ScriptedClock clock;
    HapticLoop loop(skin_and_lid("stiffness_n_per_mm = 0.1\n"), clock);
    DeviceState state;
    // Begun in the cavity, and within the skin: that is not felt. Out of it through nothing.
    for (const double height : {45e-3, 46e-3, 47e-3}) {
        state.position = {0, 0, height};
        loop.frame(state);
    }
    loop.adopt(skin_and_lid(""));
    const FrameReport frame = loop.frame(state);
    EXPECT_LE(glm::length(frame.proxy), 48e-3 + 1e-6) << "the cavity holds";
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
