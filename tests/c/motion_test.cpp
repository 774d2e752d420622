// SPDX-License-Identifier: Apache-2.0
// Bodies that move, and scenes that change, through the C interface.
#include <palpate/palpate_c.h>

#include <cstdint>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/c/c_handles.h"

namespace palpate {
namespace {

using test::sized;
using testing::HasSubstr;

std::string ball(double radius_mm, const std::string& more) {
    return "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = " + std::to_string(radius_mm) +
           "\n[surface.ball]\nvolume = \"v\"\n" + more +
           "\n[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n";
}

palpate_frame frame_at(const test::LoopPtr& loop, double x, double z) {
    auto probe = sized<palpate_probe>();
    probe.position_m[0] = x;
    probe.position_m[2] = z;
    auto frame = sized<palpate_frame>();
    EXPECT_EQ(palpate_loop_frame(loop.get(), &probe, &frame), PALPATE_OK);
    return frame;
}

TEST(PalpateCMotion, ABodyPushesAndItsWrenchIsTheOpposite) {
    const test::ScenePtr scene = test::parsed(ball(20, "moves = true"));
    const test::LoopPtr loop = test::made(scene);
    frame_at(loop, 0.0, 0.025);
    auto pose = sized<palpate_pose>();
    palpate_frame frame{};
    for (int i = 1; i <= 70; ++i) {
        pose.position_m[2] = 1e-4 * i;
        ASSERT_EQ(palpate_loop_set_pose(loop.get(), 0, &pose), PALPATE_OK);
        frame = frame_at(loop, 0.0, 0.025);
    }
    EXPECT_NEAR(frame.force_n[2], 500.0 * 0.002, 5e-5);
    auto wrench = sized<palpate_wrench>();
    ASSERT_EQ(palpate_loop_wrench(loop.get(), 0, &wrench), PALPATE_OK);
    EXPECT_NEAR(wrench.force_n[2], -500.0 * 0.002, 5e-5);
    EXPECT_NEAR(wrench.torque_n_m[0], 0.0, 1e-9);
    auto at = sized<palpate_pose>();
    ASSERT_EQ(palpate_loop_pose(loop.get(), 0, &at), PALPATE_OK);
    EXPECT_EQ(at.position_m[2], pose.position_m[2]);
    EXPECT_EQ(at.orientation[0], 1.0); // all 0 was given: not turned
}

TEST(PalpateCMotion, RefusesWhatIsNoPose) {
    const test::ScenePtr scene = test::parsed(ball(20, "moves = true"));
    const test::LoopPtr loop = test::made(scene);
    auto pose = sized<palpate_pose>();
    EXPECT_EQ(palpate_loop_set_pose(nullptr, 0, &pose), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_loop_set_pose(loop.get(), 0, nullptr), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_loop_set_pose(loop.get(), 1, &pose), PALPATE_BAD_CALL);
    pose.position_m[0] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(palpate_loop_set_pose(loop.get(), 0, &pose), PALPATE_BAD_CALL);
    pose.position_m[0] = 0.0;
    pose.size = 8;
    EXPECT_EQ(palpate_loop_set_pose(loop.get(), 0, &pose), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_loop_pose(loop.get(), 0, &pose), PALPATE_BAD_CALL);
    auto wrench = sized<palpate_wrench>();
    EXPECT_EQ(palpate_loop_wrench(nullptr, 0, &wrench), PALPATE_BAD_CALL);
    const test::ScenePtr still_scene = test::parsed(ball(20, ""));
    const test::LoopPtr still = test::made(still_scene);
    auto given = sized<palpate_pose>();
    EXPECT_EQ(palpate_loop_set_pose(still.get(), 0, &given), PALPATE_BAD_CALL);
}

TEST(PalpateCMotion, AnotherSceneIsAdopted) {
    const test::ScenePtr scene = test::parsed(ball(20, ""));
    const test::LoopPtr loop = test::made(scene);
    frame_at(loop, 0.0, 0.021);
    frame_at(loop, 0.0, 0.018);
    const palpate_frame before = frame_at(loop, 0.0, 0.018);
    palpate_error error = test::no_error();
    {
        const test::ScenePtr weaker = test::parsed(ball(20, "strength_n = 0.5"));
        ASSERT_EQ(palpate_loop_adopt(loop.get(), weaker.get(), &error), PALPATE_OK)
            << error.message;
    } // the loop keeps what it needs
    const palpate_frame first = frame_at(loop, 0.0, 0.018);
    EXPECT_EQ(first.frame, before.frame + 1);
    std::uint32_t bit = 0;
    while (std::string(palpate_flag_name(bit)) != "scene_adopted")
        ++bit;
    EXPECT_EQ(first.flags >> bit & 1u, 1u);
    palpate_frame frame = first;
    for (int i = 0; i < 20; ++i)
        frame = frame_at(loop, 0.0, 0.018);
    EXPECT_NEAR(frame.force_n[2], 0.5, 0.01);

    const test::ScenePtr other = test::parsed(ball(20, "") + "[limits]\nforce_n = 3\n");
    EXPECT_EQ(palpate_loop_adopt(loop.get(), other.get(), &error), PALPATE_BAD_INPUT);
    EXPECT_THAT(error.message, HasSubstr("limits.force_n"));
    EXPECT_EQ(palpate_loop_adopt(nullptr, other.get(), &error), PALPATE_BAD_CALL);
    EXPECT_EQ(palpate_loop_adopt(loop.get(), nullptr, &error), PALPATE_BAD_CALL);
}

} // namespace
} // namespace palpate
