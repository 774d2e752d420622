// SPDX-License-Identifier: Apache-2.0
// A hand that presses and strokes a ball through a device that fails at random, for a million
// frames.
#include <cmath>

#include <gtest/gtest.h>

#include <palpate/engine/scene/scene_file.h>

#include "tests/support/faulty_device.h"
#include "tests/support/pressed_hand.h"

namespace palpate {
namespace {

using test::FaultyDevice;

constexpr double kForce = 5.0;       // N: the scene's limit
constexpr double kSlew = 2.0;        // N per ms: the scene's, and faster than the fade must be
constexpr double kRounding = 1e-12;  // N
constexpr double kSilence_s = 10e-3; // no force this long after the last true sample
constexpr long kFrames = 1000000;

/// Strokes to and fro across the top of a ball of 50 mm, in and out, for as long as it takes.
std::vector<HandIntent> strokes() {
    std::vector<HandIntent> intents;
    for (int i = 0; i < 5000; ++i) {
        const double angle = 0.3 * std::sin(1.7 * i);
        const double radius = 0.050 + (i % 3 == 0 ? 0.008 : -0.006);
        intents.push_back(
            {0.2 * i, radius * Vec3{std::sin(angle), 0.1 * std::cos(0.3 * i), std::cos(angle)}});
    }
    return intents;
}

TEST(DeviceFaults, AMillionFramesOfThemAreSurvivedWithinTheLimits) {
    const auto scene = std::make_shared<const Scene>(parse_scene(
        "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n[surface.s]\nvolume = \"v\"\n"
        "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n[coupling]\nstiffness_n_per_m = 1000\n"
        "damping_n_s_per_m = 0.1\n",
        "ball.toml"));
    SimulatedHand hand({}, strokes());
    FaultyDevice device(hand, 7);
    test::ScriptedClock clock;
    HapticLoop loop(scene, clock, scene->description().loop, device.properties());
    Vec3 before{0.0};
    long felt = 0, returned = 0;
    bool was_felt = false;
    std::uint32_t seen = 0;
    for (long frame = 0; frame < kFrames; ++frame) {
        DeviceState state;
        ASSERT_TRUE(device.read(state));
        const FrameReport report = loop.frame(state);
        device.write(report.force);
        ASSERT_TRUE(is_finite(report.force) && is_finite(report.proxy)) << frame;
        ASSERT_LE(glm::length(report.force), kForce + kRounding) << frame;
        ASSERT_LE(glm::length(report.force - before), kSlew + kRounding) << frame;
        if (device.silent_s() >= kSilence_s) {
            ASSERT_EQ(report.force, Vec3(0.0)) << frame << " fault " << device.fault();
        }
        const bool is_felt = glm::length(report.force) > 0.1;
        felt += is_felt;
        returned += is_felt && !was_felt;
        was_felt = is_felt;
        seen |= report.flags;
        before = report.force;
    }
    EXPECT_GT(felt, kFrames / 10) << "alive";
    EXPECT_GT(returned, 1000) << "after each fault again";
    for (const long frames : device.frames())
        EXPECT_GT(frames, 100);
    for (const FrameFlag flag :
         {kProbeNotFinite, kDeviceStale, kProbeJumped, kWaitsForSmallForce, kRampsIn})
        EXPECT_TRUE(seen & flag) << flag;
    EXPECT_FALSE(seen & kForceNotFinite);
}

} // namespace
} // namespace palpate
