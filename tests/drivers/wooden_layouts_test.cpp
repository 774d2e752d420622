// SPDX-License-Identifier: Apache-2.0
// What holds for each of the three report layouts, over the real libhidapi-hidraw, against the
// boards' firmware (wooden_firmware.h).
#include <atomic>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "tests/drivers/wooden_rig.h"

namespace palpate {
namespace {

using std::chrono::milliseconds;
using test::HidNode;
using test::is_fresh;
using test::kHome;
using test::kPath;
using test::patient;
using test::Rig;
using test::state_of;
using test::watchful;
using test::WoodenFirmware;
using test::WriteFault;

class WoodenLayouts : public testing::TestWithParam<std::size_t> {};
INSTANTIATE_TEST_SUITE_P(Bytes, WoodenLayouts, testing::Values(8, 14, 64));

TEST_P(WoodenLayouts, Case1LayoutIsFoundByTheFirstReport) {
    Rig rig(GetParam());
    rig.device.open();
    EXPECT_EQ(rig.device.properties().name, "woodenhaptics_v2015 at " + kPath + ", reports of " +
                                                std::to_string(GetParam()) + " bytes");
}

TEST_P(WoodenLayouts, PositionFollowsTheCounters) {
    Rig rig(GetParam());
    rig.board_says([&] { rig.board.power_on_counters = {123, -77, 4000, 0, 0, 0}; });
    rig.node.plug_in();
    rig.device.open();
    // Home is where the handle was when it was opened, whatever the counters read.
    EXPECT_LT(glm::length(state_of(rig.device).position - kHome), 1e-15);
    rig.device.start();

    // The second vector of wooden_model_test.cpp: counts 500, 1000, 6000. The base's counters run
    // backwards.
    rig.board_says([&] { rig.board.counters = {123 - 500, -77 - 1000, 4000, 0, 0, 0}; });
    const Vec3 expected(0.076623, 0.029215, 0.198015);
    EXPECT_TRUE(test::comes_true(
        [&] { return glm::length(state_of(rig.device).position - expected) < 1e-6; }));
    EXPECT_EQ(state_of(rig.device).freshness, Freshness::fresh);
    EXPECT_EQ(rig.device.counts().rejected_reports, 0u);
}

TEST_P(WoodenLayouts, ForceBecomesTheCurrentsOfThePose) {
    Rig rig(GetParam());
    rig.device.open();
    rig.device.start();
    const std::array<int, 3> expected{1182, 659, -1182};
    EXPECT_TRUE(rig.push_until({1.0, 2.0, -1.5}, [&] { return rig.board.milliamps == expected; }));
    EXPECT_EQ(rig.board_says([&] { return rig.board.reports_ignored; }), 0);
}

TEST_P(WoodenLayouts, Case5CurrentsAreLimitedInTheirDirection) {
    Rig rig(GetParam());
    rig.device.open();
    rig.device.start();
    // 100 times the force above: the same direction at the limit, cut to whole mA.
    EXPECT_TRUE(rig.push_until({100.0, 200.0, -150.0}, [&] {
        const auto [a, b, c] = rig.board.milliamps;
        return a >= 1998 && std::abs(b - 1115) <= 1 && c <= -1998;
    }));
    EXPECT_LE(rig.board_says([&] { return rig.board.largest_milliamps; }), 1999);
}

TEST_P(WoodenLayouts, Case5ForceThatIsNoNumberIsNoCurrent) {
    Rig rig(GetParam());
    rig.device.open();
    rig.device.start();
    const double odd[] = {std::numeric_limits<double>::quiet_NaN(),
                          std::numeric_limits<double>::infinity()};
    for (const double value : odd) {
        ASSERT_TRUE(rig.push_until({1.0, 0.0, 0.0}, [&] { return rig.board.milliamps[1] != 0; }));
        EXPECT_TRUE(rig.push_until({0.0, value, 1.0}, [&] { return rig.board.last_was_zero; }));
    }
}

/// The board has been sent a force, then `end()` takes it away.
template <typename F>
void expect_zero_after(std::size_t report_size, F end) {
    auto rig = std::make_unique<Rig>(report_size);
    rig->device.open();
    rig->device.start();
    ASSERT_TRUE(rig->push_until({0.0, 0.0, 1.0}, [&] { return rig->board.milliamps[2] != 0; }));
    end(rig->device);
    // No waiting: the zero has been sent when that returns.
    EXPECT_TRUE(rig->board_says([&] { return rig->board.last_was_zero; }));
    EXPECT_EQ(rig->board_says([&] { return rig->board.milliamps; }), (std::array<int, 3>{}));
}

TEST_P(WoodenLayouts, Case5ZeroIsSentWhenStopped) {
    expect_zero_after(GetParam(), [](WoodenDevice& device) { device.stop(); });
}

TEST_P(WoodenLayouts, Case5ZeroIsSentWhenClosed) {
    expect_zero_after(GetParam(), [](WoodenDevice& device) { device.close(); });
}

TEST_P(WoodenLayouts, Case5ZeroIsSentWhenAnExceptionDestroysTheDevice) {
    WoodenFirmware board(GetParam());
    HidNode node(kPath, board);
    try {
        WoodenDevice device(wooden_model("woodenhaptics_v2015"), patient());
        device.open();
        device.start();
        ASSERT_TRUE(test::comes_true([&] {
            device.write({0.0, 0.0, 1.0});
            return node.at_rest([&] { return board.milliamps[2] != 0; });
        }));
        throw std::runtime_error("something else");
    } catch (const std::runtime_error&) {
        EXPECT_TRUE(node.at_rest([&] { return board.last_was_zero; }));
    }
}

TEST_P(WoodenLayouts, Case6ForceIsTakenAwayWhenTheServoFallsSilent) {
    Rig rig(GetParam(), watchful());
    rig.device.open();
    rig.device.start();
    ASSERT_TRUE(rig.push_until({0.0, 0.0, 1.0}, [&] { return rig.board.milliamps[2] != 0; }));
    // Reports go on; only nobody writes a force any more.
    EXPECT_TRUE(rig.node.wait_until([&] { return rig.board.last_was_zero; }));
    EXPECT_TRUE(rig.board_says([&] { return rig.board.motors_on; }));
}

TEST_P(WoodenLayouts, Case8OddReportsChangeNothing) {
    Rig rig(GetParam());
    rig.device.open();
    rig.device.start();
    const std::uint32_t trial = state_of(rig.device).trial;
    std::uint32_t rejected = 0;
    for (const std::size_t length : {1, 3, 7, 9, 13, 15, 63, 65}) {
        rig.board_says([&] { rig.board.instead = test::Bytes(length, 0x55); });
        ++rejected;
        ASSERT_TRUE(
            test::comes_true([&] { return rig.device.counts().rejected_reports == rejected; }));
    }
    rig.board_says([&] { rig.board.instead = test::Bytes(); });
    const int sent = rig.board_says([&] { return rig.board.reports_sent; });
    ASSERT_TRUE(rig.node.wait_until([&] { return rig.board.reports_sent > sent + 5; }));
    const DeviceState state = state_of(rig.device);
    EXPECT_LT(glm::length(state.position - kHome), 1e-15);
    EXPECT_EQ(state.trial, trial);
    EXPECT_EQ(rig.device.counts().losses, 0u);
}

TEST_P(WoodenLayouts, Case9UnpluggedIsStaleAndBackItIsFreshAndOfANewTrial) {
    auto settings = watchful();
    settings.force_hold_s = 3600.0; // however long forces are held: none of before is of use
    Rig rig(GetParam(), settings);
    rig.device.open();
    rig.device.start();
    for (std::uint32_t i = 1; i <= 3; ++i) {
        ASSERT_TRUE(rig.push_until({0.0, 0.0, 1.0}, [&] { return rig.board.milliamps[2] != 0; }));
        ASSERT_TRUE(test::comes_true([&] { return is_fresh(rig.device); }));
        const std::uint32_t trial = state_of(rig.device).trial;
        rig.node.unplug();
        ASSERT_TRUE(test::comes_true([&] { return !is_fresh(rig.device); }));
        ASSERT_TRUE(test::comes_true([&] { return rig.device.counts().losses == i; }));
        ASSERT_TRUE(test::comes_true([&] { return !is_fresh(rig.device); }));

        rig.board_says([&] { rig.board.power_on_counters = {int(i) * 100, 0, 0, 0, 0, 0}; });
        // Nobody writes a force from now on: none may reach the motors.
        rig.node.plug_in();
        ASSERT_TRUE(test::comes_true([&] { return is_fresh(rig.device); }));
        const int received = rig.board_says([&] { return rig.board.reports_received; });
        ASSERT_TRUE(rig.node.wait_until([&] { return rig.board.reports_received > received + 5; }));
        EXPECT_EQ(rig.board_says([&] { return rig.board.milliamps; }), (std::array<int, 3>{}));
        const DeviceState state = state_of(rig.device);
        EXPECT_GT(state.trial, trial);
        EXPECT_LT(glm::length(state.position - kHome), 1e-15);
    }
}

TEST_P(WoodenLayouts, Case9UnpluggedDuringAWriteIsNoticed) {
    Rig rig(GetParam(), watchful());
    rig.device.open();
    rig.device.start();
    rig.node.set_write_fault(WriteFault::blocks);
    // Nothing moves the servo's calls: the board takes no force, so what it says is not fresh.
    ASSERT_TRUE(test::comes_true([&] { return !is_fresh(rig.device); }));
    rig.node.unplug();
    ASSERT_TRUE(test::comes_true([&] { return rig.device.counts().losses == 1; }));
    rig.node.set_write_fault(WriteFault::none);
    rig.node.plug_in();
    EXPECT_TRUE(test::comes_true([&] { return is_fresh(rig.device); }));
}

TEST_P(WoodenLayouts, Case10ServoDoesNotWaitForABoardThatTakesNoForce) {
    Rig rig(GetParam(), watchful());
    rig.device.open();
    rig.device.start();
    ASSERT_TRUE(rig.push_until({0.0, 0.0, 1.0}, [&] { return rig.board.milliamps[2] != 0; }));
    rig.node.set_write_fault(WriteFault::blocks);
    ASSERT_TRUE(test::comes_true([&] { return !is_fresh(rig.device); }));
    // These would not return if one of them waited: the fault ends only below.
    for (int i = 0; i < 100000; ++i) {
        rig.device.write({0.0, 0.0, 1.0});
        state_of(rig.device);
    }
    EXPECT_TRUE(test::comes_true([&] { return !is_fresh(rig.device); }));
    rig.node.set_write_fault(WriteFault::none);
    EXPECT_TRUE(test::comes_true([&] { return is_fresh(rig.device); }));
}

// It was taken to be at home again, wherever the hand held it.
TEST_P(WoodenLayouts, Case10BoardThatIsOpenedAnewIsWhereItsHandleIs) {
    Rig rig(GetParam(), watchful());
    rig.device.open();
    rig.device.start();
    rig.board_says([&] { rig.board.counters = {-500, -1000, 0, 0, 0, 0}; });
    const Vec3 expected(0.076623, 0.029215, 0.198015); // as in PositionFollowsTheCounters
    ASSERT_TRUE(test::comes_true([&] {
        return is_fresh(rig.device) && glm::length(state_of(rig.device).position - expected) < 1e-6;
    }));
    const std::uint32_t trial = state_of(rig.device).trial;
    rig.node.set_write_fault(WriteFault::fails);
    ASSERT_TRUE(test::comes_true([&] { return rig.device.counts().losses > 0; }));
    rig.node.set_write_fault(WriteFault::none);
    ASSERT_TRUE(test::comes_true([&] { return rig.device.counts().connections > 1; }));
    ASSERT_TRUE(test::comes_true(
        [&] { return is_fresh(rig.device) && state_of(rig.device).trial > trial; }));
    EXPECT_LT(glm::length(state_of(rig.device).position - expected), 1e-6);
}

// One that was without power meanwhile counts from 0 again: it was taken to have counted on.
TEST_P(WoodenLayouts, Case10BoardThatWasUnpluggedMeanwhileIsAtHome) {
    WoodenDevice::Settings settings = patient();
    settings.reconnect_s = 1.0;
    Rig rig(GetParam(), settings);
    rig.board_says([&] { rig.board.power_on_counters = {123, -77, 4000, 0, 0, 0}; });
    rig.node.plug_in();
    rig.device.open();
    rig.device.start();
    ASSERT_TRUE(test::comes_true([&] { return is_fresh(rig.device); }));
    rig.node.set_write_fault(WriteFault::fails);
    ASSERT_TRUE(test::comes_true([&] { return rig.device.counts().losses > 0; }));
    rig.node.unplug();
    rig.board_says([&] { rig.board.power_on_counters = {}; });
    rig.node.set_write_fault(WriteFault::none);
    rig.node.plug_in();
    ASSERT_TRUE(test::comes_true([&] { return rig.device.counts().connections > 1; }));
    ASSERT_TRUE(test::comes_true([&] { return is_fresh(rig.device); }));
    EXPECT_LT(glm::length(state_of(rig.device).position - kHome), 1e-6);
}

TEST_P(WoodenLayouts, Case10BoardThatRefusesForcesIsOpenedAnew) {
    for (const WriteFault fault : {WriteFault::fails, WriteFault::is_cut}) {
        Rig rig(GetParam(), watchful());
        rig.device.open();
        rig.device.start();
        ASSERT_TRUE(test::comes_true([&] { return is_fresh(rig.device); }));
        rig.node.set_write_fault(fault);
        ASSERT_TRUE(test::comes_true([&] { return rig.device.counts().losses > 0; }));
        ASSERT_TRUE(test::comes_true([&] { return !is_fresh(rig.device); }));
        EXPECT_GE(rig.device.counts().failed_writes, 5u);
        rig.node.set_write_fault(WriteFault::none);
        EXPECT_TRUE(test::comes_true([&] { return is_fresh(rig.device); }));
    }
}

/// Everything that a cable, a board and a system do, in any order, while a servo reads and writes.
TEST_P(WoodenLayouts, FaultsAtRandomLeaveItAliveAndWithinItsLimits) {
    const std::uint32_t seed = 16;
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const auto chosen_from = [&](int n) {
        return std::uniform_int_distribution<int>(0, n - 1)(random);
    };
    WoodenDevice::Settings settings = watchful();
    settings.reconnect_s = 0.001;
    Rig rig(GetParam(), settings);
    rig.device.open();
    rig.device.start();

    std::atomic<bool> ended{false};
    std::atomic<int> not_finite{0};
    std::thread servo([&] {
        constexpr double odd[] = {0.0, 1.0, -1e300, std::numeric_limits<double>::quiet_NaN(),
                                  std::numeric_limits<double>::infinity()};
        for (std::size_t i = 0; !ended; ++i) {
            DeviceState state;
            if (!rig.device.read(state) || !is_finite(state.position) || !is_finite(state.velocity))
                ++not_finite;
            rig.device.write({odd[i % 5], odd[i / 5 % 5], 1.0});
            std::this_thread::sleep_for(std::chrono::microseconds(200));
        }
    });
    for (int i = 0; i < 300; ++i) {
        switch (chosen_from(8)) {
        case 0:
            rig.node.unplug();
            break;
        case 1:
        case 2:
            rig.node.plug_in();
            break;
        case 3:
            rig.node.set_write_fault(WriteFault(chosen_from(4)));
            break;
        case 4:
            rig.node.set_write_fault(WriteFault::none);
            break;
        case 5:
            rig.board_says([&] {
                rig.board.instead = test::Bytes(static_cast<std::size_t>(chosen_from(70)), 0x7F);
            });
            break;
        case 6:
            rig.board_says([&] {
                for (int& counter : rig.board.counters)
                    counter += chosen_from(4001) - 2000;
                rig.board.calibration_button = chosen_from(4) == 0;
            });
            break;
        default:
            rig.board_says([&] { rig.board.silent = chosen_from(2) == 0; });
            break;
        }
        std::this_thread::sleep_for(milliseconds(chosen_from(5)));
    }
    rig.board_says([&] { rig.board.silent = false; });
    rig.node.set_write_fault(WriteFault::none);
    rig.node.plug_in();
    EXPECT_TRUE(rig.node.wait_until([&] { return rig.board.milliamps[2] != 0; }));
    ended = true;
    servo.join();
    EXPECT_TRUE(test::comes_true([&] { return is_fresh(rig.device); }));
    EXPECT_EQ(not_finite, 0);
    EXPECT_LE(rig.board_says([&] { return rig.board.largest_milliamps; }), 1999);
    rig.device.stop();
    EXPECT_TRUE(rig.board_says([&] { return rig.board.last_was_zero; }));
}

} // namespace
} // namespace palpate
