// SPDX-License-Identifier: Apache-2.0
// Effects that go along with a body: carried about together with the hand, they feel as at rest.
#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/haptics/stepping/frame_flags.h>

#include "tests/support/scripted_clock.h"

namespace palpate {
namespace {

using testing::HasSubstr;

constexpr double kStiffness = 500.0; // N/m, the default
// A frame ends within 0.1 um of the balance. What slips remembers where it slipped to: some frames
// add up.
constexpr double kForceError = 20.0 * kStiffness * 0.1e-6;

const std::string kBody = "[volume.ball]\nanalytic = \"solid_sphere\"\nradius_mm = 20\n"
                          "[volume.stream]\nanalytic = \"helix\"\nradius_mm = 20\npitch_mm = 30\n"
                          "[surface.ball]\nvolume = \"ball\"\n";
const std::string kFelt = "[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n";

/// A scene with an effect; `moves`: on a body, with the effect on it if `along`.
std::shared_ptr<const Scene> scene_with(const std::string& effect, bool moves, bool along) {
    std::string text = kBody + (moves ? "moves = true\n" : "") + kFelt + "[[effect]]\n" + effect;
    if (along) text += "moves_with = \"ball\"\n";
    return std::make_shared<const Scene>(parse_scene(text, "moving.toml"));
}

/// A hand that goes round the ball's side, above it and 2 mm into it.
Vec3 hand_at(double time_s) {
    const double angle = 4.0 * time_s, distance_m = 0.020 + 0.002 * std::sin(15.0 * time_s);
    return distance_m * glm::normalize(Vec3{std::cos(angle), std::sin(angle), 0.4});
}

/// Where the body is: it goes 20 mm to and fro, and turns by up to 0.5 rad.
RigidPose body_at(double time_s) {
    return {{0.02 * std::sin(3.0 * time_s), 0.01 * std::sin(2.0 * time_s), 0.005},
            glm::angleAxis(0.5 * std::sin(2.0 * time_s), glm::normalize(Vec3{1, 2, 3}))};
}

struct Difference {
    double force_n = 0.0;     ///< the greatest
    double strongest_n = 0.0; ///< force at rest
};

/// The forces of a hand at rest and of one that is carried about with the body, as the body sees
/// them.
Difference carried_about(const std::string& effect, bool along, bool along_by_itself = false) {
    test::ScriptedClock clock;
    HapticLoop at_rest(scene_with(effect, false, false), clock);
    HapticLoop carried(scene_with(effect, true, along && !along_by_itself), clock);
    Difference difference;
    for (int frame = 0; frame < 600; ++frame) {
        const double time_s = 1e-3 * frame;
        const RigidPose pose = body_at(time_s);
        DeviceState hand;
        hand.time_s = time_s;
        hand.position = hand_at(time_s);
        const Vec3 expected = at_rest.frame(hand).force;
        hand.position = RigidMap(pose).point(hand.position);
        EXPECT_TRUE(carried.set_pose(0, pose));
        const FrameReport report = carried.frame(hand);
        const Vec3 force = RigidMap(pose).direction_back(report.force);
        difference.force_n = std::max(difference.force_n, glm::length(force - expected));
        difference.strongest_n = std::max(difference.strongest_n, glm::length(expected));
    }
    return difference;
}

struct Case {
    const char* name;
    std::string keys;
};

std::ostream& operator<<(std::ostream& out, const Case& of) { return out << of.name; }

class MovingEffects : public testing::TestWithParam<Case> {};

TEST_P(MovingEffects, FeelAsAtRestWhenHandAndBodyAreCarriedAbout) {
    const Difference along = carried_about(GetParam().keys, true);
    EXPECT_LT(along.force_n, kForceError);
    EXPECT_GT(along.strongest_n, 0.2);
    // Where it stays behind, it is felt as another.
    EXPECT_GT(carried_about(GetParam().keys, false).force_n, 10.0 * kForceError);
}

std::string over(const std::string& type, const std::string& volume, const std::string& more = "") {
    return "type = \"" + type + "\"\nvolume = \"" + volume + "\"\nstrength_n = 0.5\n" + more;
}

INSTANTIATE_TEST_SUITE_P(
    OfEachKind, MovingEffects,
    testing::Values(
        Case{"gradient_force", "type = \"gradient_force\"\nvolume = \"ball\"\n"
                               "strength_n = [[-0.002, 0.1], [0.002, 0.6]]\n"},
        Case{"gradient_surface", over("gradient_surface", "ball")},
        Case{"vector_force", over("vector_force", "stream")},
        Case{"vector_follow_tangent", over("vector_follow", "stream", "guide = \"tangent\"\n")},
        Case{"fibre_follow_tangent", over("fibre_follow", "stream", "guide = \"tangent\"\n")},
        Case{"vector_follow", over("vector_follow", "stream")},
        Case{"fibre_follow", over("fibre_follow", "stream", "guide = \"midpoint\"\n")},
        Case{"front_shape", over("front_shape", "stream")},
        Case{"vortex", over("vortex", "stream")},
        Case{"point", "type = \"guide\"\npoints_mm = [[25, 5, 5]]\nstrength_n = 0.5\n"},
        Case{"curve", "type = \"guide\"\nstrength_n = 0.5\n"
                      "points_mm = [[25, 0, 8], [0, 25, 8], [-25, 3, 5], [0, -25, 8]]\n"},
        Case{"viscosity", "type = \"viscosity\"\nvolume = \"ball\"\n"
                          "damping_n_s_per_m = [[-0.002, 0], [0.002, 5]]\n"}),
    [](const auto& of) { return std::string(of.param.name); });

TEST(MovingEffectsOfOneSurface, GoAlongWithItByThemselves) {
    const std::string inside = "type = \"viscosity\"\nsurface = \"ball\"\ndamping_n_s_per_m = 5\n";
    EXPECT_LT(carried_about(inside, true, true).force_n, kForceError);
}

TEST(MovingEffectsAmongOthers, SeeWhatDrawsInTheirOwnFrame) {
    // A curve looks where forces draw: both of the body.
    const std::string both = "type = \"guide\"\nstrength_n = 0.5\n"
                             "points_mm = [[25, 0, 8], [0, 25, 8], [-25, 3, 5], [0, -25, 8]]\n"
                             "moves_with = \"ball\"\n[[effect]]\n" +
                             over("vector_force", "stream");
    const std::string at_rest = "type = \"guide\"\nstrength_n = 0.5\n"
                                "points_mm = [[25, 0, 8], [0, 25, 8], [-25, 3, 5], [0, -25, 8]]\n"
                                "[[effect]]\n" +
                                over("vector_force", "stream");
    test::ScriptedClock clock;
    HapticLoop still(scene_with(at_rest, false, false), clock);
    HapticLoop carried(scene_with(both, true, true), clock);
    for (int frame = 0; frame < 600; ++frame) {
        const RigidPose pose = body_at(1e-3 * frame);
        DeviceState hand;
        hand.position = hand_at(1e-3 * frame);
        const Vec3 expected = still.frame(hand).force;
        hand.position = RigidMap(pose).point(hand.position);
        carried.set_pose(0, pose);
        const Vec3 force = RigidMap(pose).direction_back(carried.frame(hand).force);
        ASSERT_LT(glm::length(force - expected), kForceError) << frame;
    }
}

TEST(MovingEffectsAsValues, GoOnFromASavedStateWithTheSameBits) {
    test::ScriptedClock clock;
    const auto scene = scene_with(over("vector_follow", "stream"), true, true);
    HapticLoop loop(scene, clock), other(scene, clock);
    const auto step = [](HapticLoop& of, int frame) {
        of.set_pose(0, body_at(1e-3 * frame));
        DeviceState hand;
        hand.position = RigidMap(body_at(1e-3 * frame)).point(hand_at(1e-3 * frame));
        return of.frame(hand);
    };
    for (int frame = 0; frame < 200; ++frame)
        step(loop, frame);
    other.restore(loop.save());
    for (int frame = 200; frame < 300; ++frame) {
        const FrameReport expected = step(loop, frame), report = step(other, frame);
        ASSERT_EQ(report.force, expected.force) << frame;
        ASSERT_EQ(report.proxy, expected.proxy) << frame;
    }
}

// Seen: an endless line and a medium on a body that spins led the proxy away, kilometres in the
// end.
TEST(MovingEffectsWithoutABound, LeadTheProxyNoFartherThanTheLongestForceReaches) {
    const std::string body = "moves_with = \"ball\"\n";
    const std::string line = "type = \"vector_follow\"\nvolume = \"stream\"\nstrength_n = inf\n";
    const std::string medium = "type = \"viscosity\"\ndamping_n_s_per_m = 1000\n";
    constexpr double kReach_m = 5.0 / kStiffness; // limits.force_n by default
    for (const double turn_rad : {0.01, 0.3, 2.0})
        for (const std::string& effect : {line, line + body + "[[effect]]\n" + medium}) {
            test::ScriptedClock clock;
            HapticLoop loop(scene_with(effect, true, true), clock);
            double farthest_m = 0.0;
            for (int frame = 0; frame < 3000; ++frame) {
                const double angle = std::remainder(turn_rad * frame, 6.283185307179586);
                loop.set_pose(0, {Vec3{0.0}, glm::angleAxis(angle, Vec3{0, 0, 1})});
                DeviceState hand;
                hand.position = {0.03, 0.0, 0.01};
                const FrameReport report = loop.frame(hand);
                farthest_m = std::max(farthest_m, glm::length(report.proxy - report.probe));
            }
            // Each anchor is within reach, and a frame ends no farther than from there.
            EXPECT_LT(farthest_m, 1.001 * kReach_m) << turn_rad << " " << effect;
        }
}

// Seen: what two bodies hold without a bound met nowhere near the hand, 900 km away in the end.
TEST(MovingEffectsWithoutABound, OfTwoBodiesKeepTheProxyNearTheHand) {
    const auto ball = [](const std::string& name) {
        return "[volume." + name + "]\nanalytic = \"solid_sphere\"\nradius_mm = 20\n[surface." +
               name + "]\nvolume = \"" + name + "\"\nmoves = true\n";
    };
    std::string text = ball("a") + ball("b") +
                       "[volume.stream]\nanalytic = \"helix\"\nradius_mm = 20\npitch_mm = 30\n";
    for (const char* surface : {"a", "b"})
        text += "[[effect]]\ntype = \"surface\"\nsurface = \"" + std::string(surface) + "\"\n";
    const auto endless = [&](const std::string& type, const std::string& volume,
                             const std::string& body) {
        text += "[[effect]]\ntype = \"" + type + "\"\nvolume = \"" + volume +
                "\"\nstrength_n = inf\nmoves_with = \"" + body + "\"\n";
    };
    endless("gradient_surface", "a", "a");
    endless("vortex", "stream", "b");
    text += "[[effect]]\ntype = \"guide\"\npoints_mm = [[30, 0, 0], [0, 30, 5], [-30, 0, 0]]\n"
            "strength_n = inf\nmoves_with = \"b\"\n";
    const auto scene = std::make_shared<const Scene>(parse_scene(text, "moving.toml"));
    test::ScriptedClock clock;
    HapticLoop loop(scene, clock);
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> any(-1.0, 1.0);
    const auto vector = [&](double size) {
        const double x = any(random), y = any(random), z = any(random);
        return size * Vec3{x, y, z};
    };
    // Five things that yield at 5 N each, and the two balls, which may push it out by their size.
    constexpr double kFarthest_m = 5 * 5.0 / kStiffness + 2 * 0.04;
    DeviceState hand;
    for (int frame = 0; frame < 20000; ++frame) {
        for (std::size_t body = 0; body < 2; ++body)
            loop.set_pose(body, {vector(0.05),
                                 glm::angleAxis(3.0 * any(random), glm::normalize(vector(1.0)))});
        if (frame % 100 == 0) hand.position = vector(0.05);
        const FrameReport report = loop.frame(hand);
        ASSERT_EQ(report.flags & kForceNotFinite, 0u) << frame;
        ASSERT_LT(glm::length(report.proxy - report.probe), kFarthest_m) << frame;
    }
}

std::string complaint(const std::string& text) {
    try {
        const Scene scene(parse_scene(text, "scene.toml"));
    } catch (const std::exception& error) {
        return error.what();
    }
    return {};
}

TEST(MovesWith, IsRefusedWhereNothingCanGoAlong) {
    const std::string force = "[[effect]]\n" + over("vector_force", "stream");
    EXPECT_THAT(complaint(kBody + kFelt + force + "moves_with = \"ball\"\n"),
                testing::AllOf(HasSubstr("scene.toml:"), HasSubstr("moves_with = \"ball\""),
                               HasSubstr("stands still"), HasSubstr("moves = true")));
    const std::string moving = kBody + "moves = true\n" + kFelt;
    EXPECT_THAT(complaint(moving + force + "moves_with = \"bal\"\n"),
                testing::AllOf(HasSubstr("moves_with"), HasSubstr("ball")));
    EXPECT_THAT(complaint(moving + "[[effect]]\ntype = \"constant_force\"\nforce_n = [0, 0, 1]\n"
                                   "moves_with = \"ball\"\n"),
                HasSubstr("moves_with"));
    EXPECT_THAT(complaint(moving + "[[effect]]\ntype = \"viscosity\"\nsurface = \"ball\"\n"
                                   "damping_n_s_per_m = 1\nmoves_with = \"ball\"\n"),
                HasSubstr("surface = \"ball\""));
}

TEST(MovesWith, IsRefusedInCodeToo) {
    SceneDescription scene = parse_scene(kBody + "moves = true\n" + kFelt, "scene.toml");
    scene.effects.push_back(effects::ConstantForce{.force_n = {0, 0, 1}});
    scene.effects.back().moves_with = "ball";
    EXPECT_THROW(Scene{scene}, std::invalid_argument);
    scene.effects.back() =
        effects::GradientForce{.volume = "ball", .strength = TransferFunction::constant(1.0)};
    scene.effects.back().moves_with = "no_such_surface";
    EXPECT_THROW(Scene{scene}, std::invalid_argument);
    scene.effects.back().moves_with = "ball";
    EXPECT_NO_THROW(Scene{scene});
}

TEST(MovesWith, WhatStaysBehindItsSurfaceIsWarnedOf) {
    const std::string force = "type = \"gradient_force\"\nvolume = \"ball\"\nstrength_n = 1\n";
    const auto stays = scene_with(force, true, false);
    ASSERT_EQ(stays->plan().warnings.size(), 1u);
    EXPECT_THAT(stays->plan().warnings[0], testing::AllOf(HasSubstr("effect 2 (gradient_force)"),
                                                          HasSubstr("moves_with = \"ball\"")));
    EXPECT_TRUE(scene_with(force, true, true)->plan().warnings.empty());
    EXPECT_TRUE(scene_with(force, false, false)->plan().warnings.empty());
}

TEST(MovesWith, IsOffWhereItsBodyIsNotFelt) {
    const Scene scene(parse_scene(kBody + "moves = true\n[[effect]]\n" +
                                      over("vector_force", "stream", "moves_with = \"ball\"\n"),
                                  "scene.toml"));
    ASSERT_EQ(scene.plan().effects.size(), 1u);
    EXPECT_FALSE(scene.plan().effects[0].on);
    EXPECT_THAT(scene.plan().effects[0].reason, HasSubstr("surface ball that it moves with"));
    ASSERT_EQ(scene.plan().warnings.size(), 1u);
    EXPECT_THAT(scene.plan().warnings[0], HasSubstr("effect 1 (vector_force) is left out"));
}

} // namespace
} // namespace palpate
