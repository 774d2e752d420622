// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/transform_device.h>

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace palpate {
namespace {

constexpr double kRounding_m = 1e-8; // of floats in mm

/// A tool that is told the time.
class Tool {
public:
    DeviceState at(double time_s) {
        now_s_ = time_s;
        DeviceState state;
        EXPECT_TRUE(device.read(state));
        return state;
    }
    void give(double time_s, const ToolPose& pose) {
        now_s_ = time_s;
        device.give(igtl_pose(pose));
    }

    double now_s_ = 100.0; // before the device, which asks for it
    TransformDevice device{"Tool", [this] { return now_s_; }};
};

void expect_at(const DeviceState& state, double x_m, Freshness freshness) {
    EXPECT_NEAR(state.position.x, x_m, kRounding_m);
    EXPECT_EQ(state.freshness, freshness);
}

TEST(TransformDevice, IsStaleUntilTheFirstPose) {
    Tool tool;
    EXPECT_EQ(tool.at(100.0).freshness, Freshness::stale);
    EXPECT_EQ(tool.at(105.0).trial, 0u);
    tool.give(105.0, {{0.1, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}});
    const DeviceState first = tool.at(105.001);
    expect_at(first, 0.1, Freshness::fresh); // at once, and not on a way from nowhere
    EXPECT_EQ(first.trial, 1u);
    EXPECT_NEAR(first.time_s, 5.001, 1e-9);
    EXPECT_EQ(tool.device.properties().force_n, 0.0);
}

TEST(TransformDevice, GoesFromPoseToPoseAtAnEvenSpeed) {
    Tool tool;
    tool.give(100.0, {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}});
    tool.at(100.0);
    const double half = std::numbers::sqrt2 / 2.0;
    tool.give(100.02, {{0.02, 0.0, 0.0}, {half, 0.0, 0.0, half}}); // a quarter of a turn
    expect_at(tool.at(100.02), 0.0, Freshness::fresh);
    const DeviceState middle = tool.at(100.03);
    expect_at(middle, 0.01, Freshness::fresh);
    EXPECT_NEAR(middle.velocity.x, 1.0, 1e-5); // 20 mm in 20 ms
    EXPECT_NEAR(2.0 * std::acos(middle.orientation.w), std::numbers::pi / 4.0, 1e-6);
    expect_at(tool.at(100.04), 0.02, Freshness::fresh);
    EXPECT_EQ(tool.at(100.05).velocity, Vec3(0.0)); // there, and nothing has come
    EXPECT_EQ(tool.at(100.05).trial, 1u);
    // The next one comes before the way is done: it goes on from where it is.
    tool.give(100.06, {{0.04, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}});
    tool.at(100.06);
    tool.give(100.08, {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}}); // half of 40 ms has passed
    expect_at(tool.at(100.08), 0.03, Freshness::fresh);
    expect_at(tool.at(100.09), 0.015, Freshness::fresh);
}

TEST(TransformDevice, ASilenceIsStaleAndEndsTheTrial) {
    Tool tool;
    tool.give(100.0, {{0.1, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}});
    tool.at(100.0);
    expect_at(tool.at(100.0 + TransformDevice::kSilence_s - 1e-3), 0.1, Freshness::fresh);
    expect_at(tool.at(100.0 + TransformDevice::kSilence_s + 1e-3), 0.1, Freshness::stale);
    tool.give(101.0, {{0.3, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}});
    const DeviceState again = tool.at(101.0);
    expect_at(again, 0.3, Freshness::fresh);
    EXPECT_EQ(again.trial, 2u);
}

// A trial that began there began inside of what the tool pressed.
TEST(TransformDevice, ALoopThatLooksLateSeesNoSilence) {
    Tool tool;
    for (int i = 0; i <= 20; ++i) {
        tool.give(100.0 + 0.02 * i, {{0.1 + 0.001 * i, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}});
        if (i == 0) tool.at(100.0);
    }
    const DeviceState late = tool.at(100.401);
    EXPECT_EQ(late.trial, 1u);
    EXPECT_EQ(late.freshness, Freshness::fresh);
    EXPECT_NEAR(late.position.x, 0.1, 1e-3) << "on its way from where it was";
}

TEST(TransformDevice, WhatIsNoPoseIsLeftOut) {
    Tool tool;
    EXPECT_THAT(tool.device.complaint(), testing::HasSubstr("Tool never came"));
    tool.give(100.0, {{0.1, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}});
    EXPECT_EQ(tool.device.complaint(), "");
    IgtlTransform scaled;
    scaled.values[0] = 2.0f;
    tool.device.give(scaled);
    expect_at(tool.at(100.001), 0.1, Freshness::fresh);
    EXPECT_EQ(tool.device.counts().used, 1u);
    EXPECT_EQ(tool.device.counts().faulty, 1u);
    EXPECT_THAT(tool.device.complaint(), testing::HasSubstr("1 times"));
}

} // namespace
} // namespace palpate
