// SPDX-License-Identifier: Apache-2.0
// A few cells of the maps that stability_map draws: a hand that presses a ball, in closed
// loop.
#include <algorithm>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/scene/scene_file.h>
#include <palpate/haptics/hand/passivity_control.h>

#include "tests/support/pressed_hand.h"

namespace palpate {
namespace {

using test::Press;
using test::press;
using test::Protection;

std::shared_ptr<const Scene> ball(double stiffness) {
    return std::make_shared<const Scene>(parse_scene(
        "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n[surface.s]\nvolume = \"v\"\n"
        "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n[coupling]\nstiffness_n_per_m = " +
            std::to_string(stiffness) + "\n",
        "ball.toml"));
}

HandSettings hand_at(double rate_hz, double delay_s, double step_m) {
    HandSettings settings = test::pressing_hand(delay_s, step_m);
    settings.rate_hz = rate_hz;
    return settings;
}

Press pressed(double stiffness, double delay_s, double step_m, Protection protection,
              double rate_hz = 1000.0) {
    const auto scene = ball(stiffness);
    return press(scene, test::pressed_point(*scene, {0, 0, 1}), hand_at(rate_hz, delay_s, step_m),
                 protection);
}

double tremor(double rate_hz = 1000.0) { return test::free_tremor(hand_at(rate_hz, 0.0, 10e-6)); }

/// Force and slew limits of a scene, with rounding.
void expect_limits(const Press& result, double rate_hz = 1000.0) {
    EXPECT_LE(result.force_n, 5.0 + 1e-12);
    EXPECT_LE(result.step_n, 2000.0 / rate_hz + 1e-12); // a frame's share of 2000 N/s
}

// The control: without the chain the map's far corner oscillates and gives energy.
TEST(StabilityMap, WithLimitsAloneAStiffLateWallShakesTheHand) {
    const Press shaken = pressed(5000.0, 3e-3, 60e-6, Protection::limits);
    EXPECT_TRUE(oscillates(shaken, tremor()));
    EXPECT_GT(shaken.hand_work_j, PassivitySettings{}.bank_j);
    expect_limits(shaken);
}

TEST(StabilityMap, WithTheChainNoCornerOscillatesOrGivesMoreThanTheBank) {
    for (const double stiffness : {100.0, 1000.0, 5000.0})
        for (const double delay_s : {0.0, 3e-3})
            for (const double step_m : {10e-6, 60e-6}) {
                const Press calm = pressed(stiffness, delay_s, step_m, Protection::chain);
                EXPECT_FALSE(oscillates(calm, tremor()))
                    << stiffness << " " << delay_s << " " << step_m;
                EXPECT_LE(calm.hand_work_j, PassivitySettings{}.bank_j);
                EXPECT_GT(calm.pressed_n, 0.3) << "and it is felt";
                expect_limits(calm);
            }
}

TEST(StabilityMap, SoftWallsAreTheSameWithAndWithoutTheChain) {
    const Press bare = pressed(500.0, 0.0, 30e-6, Protection::limits);
    const Press safe = pressed(500.0, 0.0, 30e-6, Protection::chain);
    EXPECT_EQ(safe.stiffness_n_per_m, 500.0);
    EXPECT_EQ(safe.flags & (kEnergyBounded | kEnergyExceeded), 0u);
    EXPECT_DOUBLE_EQ(safe.pressed_n, bare.pressed_n);
}

// A device that declares no damping: the stiffness stays, and softens as it proves to give energy.
TEST(StabilityMap, TheControllerAloneCalmsAndBoundsTheEnergy) {
    const Press bounded = pressed(5000.0, 3e-3, 60e-6, Protection::controller);
    EXPECT_EQ(bounded.stiffness_n_per_m, 5000.0);
    EXPECT_FALSE(oscillates(bounded, tremor()));
    EXPECT_LE(bounded.hand_work_j, PassivitySettings{}.bank_j);
    EXPECT_TRUE(bounded.flags & kEnergyBounded);
    EXPECT_TRUE(bounded.flags & kSoftened);
    expect_limits(bounded);
}

// k T/2 <= b: the stiffness that the device's damping pays for grows with the rate.
TEST(StabilityMap, WithTheChainAPressStaysCalmUpTo10kHz) {
    const double damping = MechanismSettings{}.damping_n_s_per_m;
    for (const double rate_hz : {2000.0, 5000.0, 10000.0}) {
        const double shakes = tremor(rate_hz);
        for (const double delay_s : {0.0, 3e-3}) {
            const Press calm = pressed(5000.0, delay_s, 60e-6, Protection::chain, rate_hz);
            EXPECT_DOUBLE_EQ(calm.stiffness_n_per_m, std::min(5000.0, 2.0 * damping * rate_hz));
            EXPECT_FALSE(oscillates(calm, shakes)) << rate_hz << " Hz, " << delay_s;
            EXPECT_LE(calm.hand_work_j, PassivitySettings{}.bank_j);
            EXPECT_GT(calm.pressed_n, 0.3) << "and it is felt";
            expect_limits(calm, rate_hz);
        }
    }
}

// A wall that shakes drives the force into both limits, so that the largest values are the limits.
TEST(StabilityMap, ForceAndSlewLimitsAreTheSameAtEachRate) {
    for (const double rate_hz : {1000.0, 2000.0, 5000.0, 10000.0}) {
        const Press shaken = pressed(5000.0, 3e-3, 60e-6, Protection::limits, rate_hz);
        EXPECT_TRUE(shaken.flags & kForceClamped) << rate_hz;
        EXPECT_NEAR(shaken.force_n, 5.0, 1e-12) << rate_hz;
        EXPECT_TRUE(shaken.flags & kForceSlewed) << rate_hz;
        EXPECT_NEAR(shaken.step_n * rate_hz, 2000.0, 1e-8) << rate_hz;
    }
}

/// Ten seconds of taps, 10 mm in front of the ball to 10 mm in it.
std::vector<HandIntent> taps(double rate_hz) {
    std::vector<HandIntent> intents;
    for (int i = 0; i < 10.0 * rate_hz; ++i)
        for (const auto& [share, z] : {std::pair{0.0, 0.06}, {0.4, 0.04}, {0.5, 0.04}, {0.8, 0.06}})
            intents.push_back({(i + share) / rate_hz, {0, 0, z}});
    return intents;
}

TEST(StabilityMap, OrdinaryTapsAreLeftAlone) {
    const auto scene = ball(600.0);
    for (const double rate_hz : {1.0, 3.0})
        for (const double delay_s : {0.0, 1e-3}) {
            HandSettings settings = test::pressing_hand(delay_s, 30e-6);
            settings.grip = GripSettings{};
            settings.arm.stiffness_n_per_m = 600.0;
            SimulatedHand hand(settings, taps(rate_hz));
            test::ScriptedClock clock;
            HapticLoop loop(scene, clock, scene->description().loop, hand.properties());
            EXPECT_DOUBLE_EQ(loop.coupling().stiffness, 600.0);
            double most_n = 0.0;
            std::uint32_t flags = 0;
            for (int frame = 0; frame < 10000; ++frame) {
                DeviceState state;
                hand.read(state);
                const FrameReport report = loop.frame(state);
                hand.write(report.force);
                most_n = std::max(most_n, report.force.z);
                flags |= report.flags;
            }
            EXPECT_GT(most_n, 2.5) << "they are felt";
            EXPECT_EQ(flags & (kEnergyBounded | kEnergyExceeded | kSoftened), 0u)
                << rate_hz << " Hz, " << delay_s;
        }
}

} // namespace
} // namespace palpate
