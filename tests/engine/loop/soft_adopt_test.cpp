// SPDX-License-Identifier: Apache-2.0
// Soft surfaces of a loop that goes on with another scene.
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/haptics/stepping/frame_flags.h>

#include "tests/engine/loop/soft_ball.h"
#include "tests/support/scripted_clock.h"

namespace palpate {
namespace {

using namespace test::soft_ball;

/// From 1 mm above the ball to 9 mm into it within 100 frames, and held there; the last frame.
FrameReport pressed(HapticLoop& loop, DeviceState& state) {
    FrameReport frame;
    for (int i = 0; i < 400; ++i) {
        state.position = {0, 0, kRadius + 1e-3 - 10e-3 * std::min(1.0, i / 100.0)};
        frame = loop.frame(state);
    }
    return frame;
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
                FrameReport frame = pressed(loop, state);
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

// It was judged from the front of what was soft: it was in front of the tip, and drew it out at the
// force limit.
TEST(SoftLoop, ANewSurfaceIsJudgedFromWhereTheTipIs) {
    const std::string soft = "stiffness_n_per_mm = 0.05\n";
    struct Case {
        std::shared_ptr<const Scene> after;
        double force_n;
    };
    for (const auto& [after, force_n] : {Case{layers(soft, true, true), 1.0},   // bone comes
                                         Case{layers("", false, true), 0.0}}) { // and skin goes
        test::ScriptedClock clock;
        HapticLoop loop(layers(soft, true, false), clock);
        DeviceState state;
        FrameReport frame;
        for (int i = 0; i <= 200; ++i) {
            state.position = {0, 0, kRadius + 1e-3 - 21e-3 * i / 200.0};
            frame = loop.frame(state);
        }
        ASSERT_NEAR(frame.force.z, 1.0, 1e-3);
        loop.adopt(after);
        frame = loop.frame(state);
        EXPECT_NE(frame.flags & kInsideAtStart, 0u);
        for (int i = 0; i < 5; ++i)
            frame = loop.frame(state);
        EXPECT_NEAR(frame.force.z, force_n, 1e-3);
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
        FrameReport frame = pressed(loop, state);
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

} // namespace
} // namespace palpate
