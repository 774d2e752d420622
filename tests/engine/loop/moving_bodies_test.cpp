// SPDX-License-Identifier: Apache-2.0
// Bodies that a program moves, as its loop has them.
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/haptics/stepping/frame_flags.h>

#include "tests/support/scripted_clock.h"

namespace palpate {
namespace {

using Standing = SurfaceStatus::Standing;

constexpr double kStiffness = 500.0;                // N/m, the default
constexpr double kForceError = kStiffness * 0.1e-6; // a frame ends within 0.1 um of the balance

std::string ball_text(const std::string& moves, const std::string& more = "") {
    return "[volume.ball]\nanalytic = \"solid_sphere\"\nradius_mm = 20\n[surface.ball]\nvolume = "
           "\"ball\"\n" +
           moves + "\n[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n" + more;
}

struct Hand {
    explicit Hand(const std::string& text = ball_text("moves = true"))
        : scene(std::make_shared<const Scene>(parse_scene(text, "moving.toml"))),
          loop(scene, clock) {}

    FrameReport to(const Vec3& probe) {
        DeviceState state;
        state.position = probe;
        return report = loop.frame(state);
    }

    std::shared_ptr<const Scene> scene;
    test::ScriptedClock clock;
    HapticLoop loop;
    FrameReport report;
};

RigidPose at(const Vec3& position) { return {position, {1, 0, 0, 0}}; }

TEST(SetPose, ABodyThatComesPushesAHeldHand) {
    Hand hand;
    const Vec3 probe{0, 0, 0.025};
    hand.to(probe);
    for (int frame = 1; frame <= 100; ++frame) { // 0.1 m/s
        ASSERT_TRUE(hand.loop.set_pose(0, at({0, 0, 1e-4 * frame})));
        hand.to(probe);
        const double depth_m = std::max(0.0, 0.02 + 1e-4 * frame - 0.025);
        ASSERT_NEAR(hand.report.force.z, kStiffness * depth_m, kForceError) << frame;
        ASSERT_EQ(hand.report.flags, kBodyMoved);
    }
    EXPECT_EQ(hand.loop.pose(0), at({0, 0, 0.01}));
    ASSERT_EQ(hand.loop.surface_states().size(), 1u);
    EXPECT_EQ(hand.loop.surface_states()[0].standing, Standing::touched);
    EXPECT_NEAR(hand.loop.surface_states()[0].depth_m, 0.0, 1e-7);
}

TEST(SetPose, TheWrenchIsWhatTheHandPutsOnTheBody) {
    Hand hand;
    const Vec3 center{0.1, 0.0, 0.0};
    hand.loop.set_pose(0, {center, glm::angleAxis(0.4, glm::normalize(Vec3{1, 2, 3}))});
    hand.to(center + Vec3{0, 0, 0.021});
    hand.to(center + Vec3{0, 0, 0.018});
    const Wrench wrench = hand.loop.wrench(0);
    EXPECT_NEAR(wrench.force.z, -kStiffness * 0.002, kForceError);
    // A ball without friction is pushed through its own centre.
    EXPECT_LT(glm::length(wrench.torque), 0.02 * kForceError + 1e-7);
    EXPECT_EQ(glm::length(hand.loop.wrench(1).force), 0.0); // there is no such body

    // Of any contact: the opposite of its force, with its arm from the body's origin.
    Hand other;
    other.to({0.0, 0.0, 0.021});
    other.to({0.001, 0.0, 0.018});
    const Wrench slanted = other.loop.wrench(0);
    const Touch touch = other.loop.touches()[0];
    EXPECT_LT(glm::length(slanted.force + touch.force), 1e-15);
    EXPECT_LT(glm::length(slanted.torque + glm::cross(touch.point, touch.force)), 1e-15);
}

TEST(SetPose, RefusesWhatIsNoPoseAndWhatDoesNotMove) {
    Hand hand;
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(hand.loop.set_pose(1, {}));
    EXPECT_FALSE(hand.loop.set_pose(0, at({kNaN, 0, 0})));
    EXPECT_FALSE(hand.loop.set_pose(0, at({2e6, 0, 0})));
    EXPECT_FALSE(hand.loop.set_pose(0, {Vec3{0.0}, {0, 0, 0, 0}}));
    EXPECT_FALSE(hand.loop.set_pose(0, {Vec3{0.0}, {kNaN, 0, 0, 0}}));
    EXPECT_TRUE(hand.loop.set_pose(0, {Vec3{0.0}, {2, 0, 0, 0}})); // any length
    EXPECT_EQ(hand.to({0, 0, 0.03}).flags, 0u); // where the scene has it, to the bit
    Hand still(ball_text(""));
    EXPECT_FALSE(still.loop.set_pose(0, {}));
    EXPECT_EQ(still.loop.pose(0), RigidPose{});
}

TEST(SetPose, ANewTrialBeginsWithThePoseThatWasSetLast) {
    Hand hand;
    hand.loop.set_pose(0, at({0.05, 0, 0}));
    EXPECT_EQ(hand.to({0.05, 0, 0.0}).flags, kInsideAtStart | kBodyMoved);
    hand.to({0.05, 0, 0.03});
    EXPECT_EQ(hand.to({0.05, 0, 0.019}).flags & kInsideAtStart, 0u);
    EXPECT_NEAR(hand.report.force.z, 0.5, kForceError);
}

TEST(SetPose, ASavedLoopGoesOnToTheSameBits) {
    Hand hand;
    const auto pose = [](int frame) {
        return RigidPose{{1e-4 * frame, 0, 5e-5 * frame},
                         glm::angleAxis(0.01 * frame, Vec3{0, 1, 0})};
    };
    const auto run = [&](int from, int to) {
        std::vector<FrameReport> reports;
        for (int frame = from; frame < to; ++frame) {
            hand.loop.set_pose(0, pose(frame));
            reports.push_back(hand.to({0.001 + 1e-5 * frame, 0.002, 0.0205}));
        }
        return reports;
    };
    run(0, 50);
    const LoopState then = hand.loop.save();
    const auto first = run(50, 100);
    hand.loop.restore(then);
    const auto again = run(50, 100);
    for (std::size_t i = 0; i < first.size(); ++i) {
        ASSERT_EQ(first[i].proxy, again[i].proxy) << i;
        ASSERT_EQ(first[i].force, again[i].force) << i;
        ASSERT_EQ(first[i].flags, again[i].flags) << i;
    }
}

TEST(SetPose, APoseThatWasSetIsAPartOfTheState) {
    Hand hand;
    hand.to({0, 0, 0.03});
    hand.loop.set_pose(0, at({0, 0, 0.015}));
    const LoopState then = hand.loop.save();
    const FrameReport first = hand.to({0, 0, 0.03});
    EXPECT_GT(first.force.z, 1.0);
    hand.loop.restore(then);
    const FrameReport again = hand.to({0, 0, 0.03});
    EXPECT_EQ(again.proxy, first.proxy);
    EXPECT_EQ(again.flags, first.flags);
}

TEST(SetPose, NothingIsLeftOutBehindAWorkspaceFromWhichABodyCouldPush) {
    const auto scene = [](const std::string& moves) {
        return Scene(parse_scene(
            ball_text(moves,
                      "[volume.far]\nanalytic = \"solid_sphere\"\nradius_mm = 5\n[surface.far]\n"
                      "volume = \"far\"\n[[effect]]\ntype = \"surface\"\nsurface = \"far\"\n"
                      "[[effect]]\ntype = \"workspace\"\n"
                      "box_mm = [[50, 50, 50], [90, 90, 90]]\n"),
            "workspace.toml"));
    };
    EXPECT_EQ(scene("").surfaces().size(), 0u);
    EXPECT_EQ(scene("moves = true").surfaces().size(), 2u);
}

TEST(SetPose, AStrengthByPlaceMovesAlong) {
    // 1 N on the ball's own surface; 0.3 m away from the ball, where it was, it would be 0.5 N.
    Hand hand(ball_text("moves = true\nstrength_volume = \"ball\"\nstrength_n = [[-0.25, 0.5], "
                        "[0, 1]]"));
    hand.loop.set_pose(0, at({0.3, 0, 0}));
    hand.to({0.3, 0, 0.021});
    for (int i = 0; i < 40; ++i)
        hand.to({0.3, 0, 0.021 - 1e-4 * i});
    EXPECT_NEAR(glm::length(hand.report.force), 1.0, 0.01);
}

TEST(MovesKey, IsReadAndChecked) {
    EXPECT_TRUE(parse_scene(ball_text("moves = true"), "s.toml").surfaces.at("ball").moves);
    EXPECT_FALSE(parse_scene(ball_text("moves = false"), "s.toml").surfaces.at("ball").moves);
    EXPECT_FALSE(parse_scene(ball_text(""), "s.toml").surfaces.at("ball").moves);
    try {
        parse_scene(ball_text("moves = 1"), "s.toml");
        FAIL() << "it was accepted";
    } catch (const std::runtime_error& error) {
        const std::string text = error.what();
        EXPECT_NE(text.find("s.toml:6"), std::string::npos) << text;
        EXPECT_NE(text.find("true or false"), std::string::npos) << text;
    }
}

} // namespace
} // namespace palpate
