// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/view_devices.h>

#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/support/scripted_device.h"

namespace palpate {
namespace {

TEST(PageDevice, MovesAsAHandCanAndGetsThere) {
    PageDevice device(Vec3{0.0}, 1000.0);
    const Vec3 target{0.3, -0.2, 0.1};
    device.aim_at(target);
    DeviceState before, state;
    ASSERT_TRUE(device.read(before));
    EXPECT_EQ(before.position, Vec3(0.0));
    Vec3 velocity_before{0.0};
    for (int i = 1; i <= 3000; ++i) {
        ASSERT_TRUE(device.read(state));
        const Vec3 velocity = (state.position - before.position) / 1e-3;
        EXPECT_LE(glm::length(velocity), PageDevice::kFastest_m_per_s * (1.0 + 1e-9));
        EXPECT_LE(glm::length(velocity - velocity_before) / 1e-3,
                  PageDevice::kMostAcceleration_m_per_s2 * (1.0 + 1e-6));
        EXPECT_DOUBLE_EQ(state.time_s, 1e-3 * i);
        velocity_before = velocity;
        before = state;
    }
    EXPECT_LT(glm::length(state.position - target), 1e-6); // e^(-30 * 2 s) of 0.4 m is less
}

TEST(PageDevice, LeavesAloneWhatIsNoPlace) {
    PageDevice device({0.01, 0.0, 0.0}, 1000.0);
    device.aim_at({std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0});
    device.aim_at({std::numeric_limits<double>::infinity(), 0.0, 0.0});
    device.aim_at({1e9, 0.0, 0.0});
    DeviceState state;
    for (int i = 0; i < 10; ++i)
        device.read(state);
    EXPECT_EQ(state.position, Vec3(0.01, 0.0, 0.0));
}

// Not with the next read(): until the trial begins the hand would be on its way back.
TEST(PageDevice, ATrialBeginsWhereItIsSaid) {
    PageDevice mouse({0.01, 0.0, 0.0}, 1000.0);
    SteeredDevice device(mouse);
    DeviceState state;
    device.read(state);
    mouse.begin_at({0.02, 0.0, 0.0});
    for (int i = 0; i < 10; ++i)
        device.read(state);
    EXPECT_EQ(state.position, Vec3(0.01, 0.0, 0.0));
    EXPECT_EQ(state.trial, 0U);
    device.restart();
    device.read(state);
    EXPECT_EQ(state.trial, 1U);
    device.trial_has_begun(0);     // a frame of the trial before, seen late
    for (int i = 1; i < 1000; ++i) // a loop that is late still begins there
        device.read(state);
    EXPECT_EQ(state.position, Vec3(0.02, 0.0, 0.0));
    device.trial_has_begun(1);
    device.read(state);
    EXPECT_LT(state.position.x, 0.02) << "it goes on to where it is wanted";
}

std::vector<DeviceState> row(int count) {
    std::vector<DeviceState> states(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i)
        states[static_cast<std::size_t>(i)].position.x = i;
    return states;
}

TEST(SteeredDevice, PlaysStatesAgainAsANewTrial) {
    SteeredDevice device(row(3), 1000.0);
    DeviceState state;
    for (int i = 0; i < 9; ++i) {
        ASSERT_TRUE(device.read(state));
        EXPECT_EQ(state.position.x, i % 3);
        EXPECT_EQ(state.trial, static_cast<std::uint32_t>(i / 3));
        EXPECT_DOUBLE_EQ(state.time_s, 1e-3 * i);
    }
    device.restart();
    device.read(state);
    EXPECT_EQ(state.position.x, 0.0);
    EXPECT_EQ(state.trial, 3u);
    EXPECT_THROW(SteeredDevice({}, 1000.0), std::invalid_argument);
}

TEST(SteeredDevice, BeginsAnewWithEachRun) {
    SteeredDevice states(row(5), 1000.0);
    PageDevice mouse({0.0, 0.0, 0.0}, 1000.0);
    SteeredDevice page(mouse);
    for (int run = 0; run < 2; ++run) {
        states.start();
        page.start();
        for (int i = 0; i < 3; ++i) {
            DeviceState state;
            ASSERT_TRUE(states.read(state));
            EXPECT_EQ(state.position.x, i);
            EXPECT_EQ(state.trial, 0u);
            EXPECT_DOUBLE_EQ(state.time_s, 1e-3 * i);
            ASSERT_TRUE(page.read(state));
            EXPECT_DOUBLE_EQ(state.time_s, 1e-3 * i);
        }
    }
}

// A recording that begins while the hand is frozen begins where it is to begin, not where the hand
// was before: that may be within a surface.
TEST(SteeredDevice, ARunThatBeginsFrozenBeginsWhereItIsTold) {
    PageDevice mouse({0.0, 0.0, 0.0}, 1000.0);
    SteeredDevice page(mouse);
    DeviceState state;
    page.start();
    page.read(state);
    page.freeze(true);
    page.read(state);
    const Vec3 front{0.0, 0.0, 0.0305};
    mouse.begin_at(front);
    page.trial_has_begun(state.trial); // of the run before
    page.start();
    for (int i = 0; i < 5; ++i) {
        page.read(state);
        EXPECT_EQ(state.position, front) << i;
    }
    // So is one that is not frozen, and it goes on with its own first frame.
    page.freeze(false);
    mouse.begin_at(front);
    page.start();
    for (int i = 0; i < 5; ++i) {
        page.read(state);
        EXPECT_EQ(state.position, front) << i;
    }
    page.trial_has_begun(state.trial);
    page.read(state);
    EXPECT_LT(state.position.z, front.z);
}

TEST(SteeredDevice, FrozenStaysWhereItIsWhileTimeGoesOn) {
    SteeredDevice device(row(100), 1000.0);
    DeviceState state;
    device.read(state);
    device.read(state);
    device.freeze(true);
    for (int i = 2; i < 5; ++i) {
        device.read(state);
        EXPECT_EQ(state.position.x, 1.0);
        EXPECT_DOUBLE_EQ(state.time_s, 1e-3 * i);
    }
    device.freeze(false);
    device.press(true);
    device.read(state);
    EXPECT_EQ(state.position.x, 2.0);
    EXPECT_EQ(state.trial, 0u);
    EXPECT_EQ(state.buttons, 1u);
}

TEST(SteeredDevice, EachPressIsSeenHoweverShortItWas) {
    SteeredDevice device(row(100), 1000.0);
    DeviceState state;
    const auto buttons = [&] {
        device.read(state);
        device.write(Vec3{0.0});
        return state.buttons;
    };
    EXPECT_EQ(buttons(), 0u);
    for (int press = 0; press < 2; ++press) { // both between two states
        device.press(true);
        device.press(false);
    }
    for (const std::uint32_t wanted : {1u, 0u, 1u, 0u, 0u})
        EXPECT_EQ(buttons(), wanted);
    device.press(true);
    device.press(true); // it is down
    for (int i = 0; i < 3; ++i)
        EXPECT_EQ(buttons(), 1u);
    device.press(false);
    device.press(true); // a press of its own: it was up in between
    for (const std::uint32_t wanted : {0u, 1u, 1u})
        EXPECT_EQ(buttons(), wanted);
    device.press(false);
    EXPECT_EQ(buttons(), 0u);
}

TEST(SteeredDevice, FreezesAHandWithoutMotorsInPlaceAndOneWithMotorsWithoutForce) {
    for (const double force_n : {0.0, 4.0}) {
        test::ScriptedDevice hand;
        hand.force_n = force_n;
        hand.on_read = [](std::size_t read, DeviceState& state) {
            state.position.x = static_cast<double>(read);
        };
        SteeredDevice device(hand);
        device.open();
        device.start();
        DeviceState state;
        device.read(state);
        const double at = state.position.x;
        device.freeze(true);
        device.read(state);
        EXPECT_EQ(state.freshness, force_n > 0.0 ? Freshness::stale : Freshness::fresh);
        if (force_n == 0.0) {
            EXPECT_EQ(state.position.x, at);
        }
        device.freeze(false);
        device.restart();
        device.read(state);
        EXPECT_EQ(state.freshness, Freshness::fresh);
        EXPECT_EQ(state.trial, 1u);
    }
}

TEST(SteeredDevice, APagesHandDoesNotGoOnUnseenWhileItIsFrozen) {
    constexpr double kRate_hz = 1000.0;
    PageDevice mouse(Vec3(0.0), kRate_hz);
    SteeredDevice device(mouse);
    DeviceState state, before;
    mouse.aim_at({0.2, 0.0, 0.0});
    for (int i = 0; i < 100; ++i)
        device.read(state);
    device.freeze(true);
    const Vec3 held = state.position;
    for (int i = 0; i < 1000; ++i) {
        device.read(state);
        EXPECT_EQ(state.position, held);
        EXPECT_EQ(state.velocity, Vec3(0.0));
    }
    device.freeze(false);
    for (int i = 0; i < 1000; ++i) {
        before = state;
        device.read(state);
        EXPECT_LE(glm::distance(state.position, before.position) * kRate_hz,
                  PageDevice::kFastest_m_per_s * (1.0 + 1e-9));
    }
    // A trial that begins meanwhile begins where it is said, and stays there.
    const Vec3 front(0.03, 0.0, 0.0);
    device.freeze(true);
    mouse.begin_at(front);
    device.restart();
    for (int i = 0; i < 300; ++i) {
        device.read(state);
        EXPECT_EQ(state.position, front);
        EXPECT_EQ(state.trial, 1u);
    }
}

TEST(SteeredDevice, APressOutlastsTheStatesThatALateLoopReadsAtOnce) {
    SteeredDevice device(row(100), 1000.0);
    device.press(true);
    device.press(false); // both while the loop stood still
    for (int frame = 0; frame < 3; ++frame) {
        DeviceState state;
        for (int read = 0; read < 5; ++read)
            device.read(state); // the frame takes the last one
        device.write(Vec3{0.0});
        EXPECT_EQ(state.buttons, frame == 0 ? 1u : 0u) << frame;
    }
}

} // namespace
} // namespace palpate
