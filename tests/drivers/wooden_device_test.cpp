// SPDX-License-Identifier: Apache-2.0
// The whole driver over the real libhidapi-hidraw, against the boards' firmware
// (wooden_firmware.h).
#include <chrono>
#include <limits>

#include <gtest/gtest.h>

#include <palpate/drivers/internal/hid_port.h>

#include "tests/drivers/wooden_rig.h"
#include "tests/support/device_calls.h"

namespace palpate {
namespace {

using test::HidNode;
using test::is_fresh;
using test::kHome;
using test::kPath;
using test::patient;
using test::Rig;
using test::state_of;
using test::watchful;
using test::WoodenFirmware;

TEST(WoodenDevice, Case2BoardThatWaitsForAnAnswerIsGivenOne) {
    for (const std::size_t size : {14, 64}) {
        Rig rig(size);
        rig.board_says([&] { rig.board.spent_first_report = true; });
        rig.node.plug_in();
        EXPECT_EQ(rig.board_says([&] { return rig.board.reports_sent; }), 0);
        rig.device.open();
        EXPECT_GT(rig.board_says([&] { return rig.board.reports_received; }), 0);
        EXPECT_EQ(rig.board_says([&] { return rig.board.largest_milliamps; }), 0);
    }
}

TEST(WoodenDevice, Case2BoardThatWasSilentIsAnsweredAgain) {
    Rig rig(14, watchful());
    rig.device.open();
    rig.device.start();
    ASSERT_TRUE(test::comes_true([&] { return is_fresh(rig.device); }));
    // One of its reports is lost: both sides would wait for each other for ever.
    rig.board_says([&] { rig.board.instead = test::Bytes(); });
    const int sent = rig.board_says([&] { return rig.board.reports_sent; });
    EXPECT_TRUE(rig.node.wait_until([&] { return rig.board.reports_sent > sent + 20; }));
}

TEST(WoodenDevice, Case2BoardThatSaysNothingIsNoDevice) {
    Rig rig(14);
    rig.board_says([&] { rig.board.silent = true; });
    try {
        rig.device.open();
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_EQ(error.what(), kPath + ": says nothing; check the power of its board and plug it "
                                        "in again");
    }
    // It is not kept from others, and opens once it speaks.
    rig.board_says([&] { rig.board.silent = false; });
    EXPECT_NO_THROW(rig.device.open());
}

TEST(WoodenDevice, Case3EachReportIsAnsweredOnce) {
    Rig rig(14);
    const auto began = std::chrono::steady_clock::now();
    rig.device.open();
    rig.device.start();
    ASSERT_TRUE(rig.node.wait_until([&] { return rig.board.reports_sent > 200; }));
    const auto [sent, received] = rig.board_says(
        [&] { return std::pair(rig.board.reports_sent, rig.board.reports_received); });
    // One may be on its way. A thread that waits for its turn for 10 ms makes an answer too many.
    EXPECT_GE(received, sent - 1);
    const auto took = std::chrono::steady_clock::now() - began;
    EXPECT_LE(received, sent + 1 + took / std::chrono::milliseconds(10));
}

TEST(WoodenDevice, Case3BoardAnswersOnceHoweverOftenItIsWrittenTo) {
    // The firmware itself, with a host that writes twice, once and never per report.
    WoodenFirmware board(14);
    board.power_on(0.0);
    const test::Bytes zero(14, 0);
    double time_s = 0.0;
    const auto reports = [&] {
        int count = 0;
        while (board.send(time_s += 0.001))
            ++count;
        return count;
    };
    EXPECT_EQ(reports(), 1);
    EXPECT_EQ(reports(), 0);
    board.receive(zero, time_s);
    EXPECT_EQ(reports(), 1);
    board.receive(zero, time_s);
    board.receive(zero, time_s);
    EXPECT_EQ(reports(), 1);
    board.receive(test::Bytes(13, 0), time_s);
    EXPECT_EQ(reports(), 0);
    EXPECT_EQ(board.reports_ignored, 1);
}

TEST(WoodenDevice, Case4PositionIsContinuousOverTheEndOf16Bits) {
    for (const std::size_t size : {8, 14, 64}) {
        Rig rig(size);
        rig.board_says([&] { rig.board.power_on_counters = {32700, -32700, 32767, 0, 0, 0}; });
        rig.node.plug_in();
        rig.device.open();
        rig.device.start();
        rig.board_says([&] { rig.board.counters = {32700 + 800, -32700 - 2000, 32767 + 1500}; });
        // The third vector of wooden_model_test.cpp: counts -800, 2000, 4500.
        const Vec3 expected(0.104802, -0.051444, 0.083778);
        EXPECT_TRUE(test::comes_true(
            [&] { return glm::length(state_of(rig.device).position - expected) < 1e-6; }));
    }
}

TEST(WoodenDevice, Case6BoardsWatchdogTripsOnAHostThatStallsAndItStartsAgainWithoutForce) {
    WoodenFirmware board(14);
    HidNode node(kPath, board);
    {
        // A host that stalls with a force on.
        internal::HidPort port(kPath);
        test::Bytes force(15, 0);
        force[1] = 100;
        ASSERT_TRUE(port.write(force));
        EXPECT_TRUE(node.at_rest([&] { return board.motors_on && board.milliamps[0] == 100; }));
        ASSERT_TRUE(node.wait_until([&] { return board.watchdog_trips == 1; }));
        EXPECT_FALSE(node.at_rest([&] { return board.motors_on; }));
    }
    WoodenDevice device(wooden_model("woodenhaptics_v2015"), watchful());
    device.open();
    device.start();
    ASSERT_TRUE(node.wait_until([&] { return board.motors_on; }));
    EXPECT_EQ(node.at_rest([&] { return board.milliamps; }), (std::array<int, 3>{}));
}

TEST(WoodenDevice, AForceOfBeforeIsNotPlayedAfterAStart) {
    auto settings = patient();
    settings.force_hold_s = 3600.0; // however long forces are held
    Rig rig(14, settings);
    rig.device.open();
    for (int time = 0; time < 2; ++time) {
        rig.device.write({0.0, 0.0, 1.0}); // not started yet, or no more
        rig.device.start();
        ASSERT_TRUE(test::comes_true([&] { return is_fresh(rig.device); }));
        const int sent = rig.board_says([&] { return rig.board.reports_sent; });
        ASSERT_TRUE(rig.node.wait_until([&] { return rig.board.reports_sent > sent + 20; }));
        EXPECT_EQ(rig.board_says([&] { return rig.board.largest_milliamps; }), 0);
        rig.device.stop();
    }
}

TEST(WoodenDevice, Case6HostNoticesABoardThatStallsAndSendsNoForceMeanwhile) {
    Rig rig(14, watchful());
    rig.device.open();
    rig.device.start();
    ASSERT_TRUE(rig.push_until({0.0, 0.0, 1.0}, [&] { return rig.board.milliamps[2] != 0; }));
    rig.board_says([&] { rig.board.silent = true; });
    // The servo goes on writing the same force: without a recent pose it is not sent.
    EXPECT_TRUE(rig.push_until({0.0, 0.0, 1.0}, [&] { return rig.board.last_was_zero; }));
    EXPECT_TRUE(test::comes_true([&] { return !is_fresh(rig.device); }));
    rig.board_says([&] { rig.board.silent = false; });
    EXPECT_TRUE(test::comes_true([&] { return is_fresh(rig.device); }));
    EXPECT_TRUE(rig.push_until({0.0, 0.0, 1.0}, [&] { return rig.board.milliamps[2] != 0; }));
}

TEST(WoodenDevice, Case11SecondDeviceIsKeptOut) {
    Rig rig(14);
    rig.device.open();
    WoodenDevice second(wooden_model("woodenhaptics_v2015"), patient());
    EXPECT_THROW(second.open(), std::runtime_error);
    rig.device.close();
    EXPECT_NO_THROW(second.open());
}

TEST(WoodenDevice, Case12CountersOfAPolhemAreSetAtHome) {
    for (const std::size_t size : {14, 64}) {
        Rig rig(size, patient(), "polhem_v3");
        const WoodenModel model = wooden_model("polhem_v3");
        rig.board_says([&] { rig.board.power_on_counters = {5, -9, 31000, 0, 7, 2}; });
        rig.node.plug_in();
        rig.device.open();
        // What the counters read before means nothing.
        EXPECT_EQ(state_of(rig.device).freshness, Freshness::stale);
        rig.device.start();
        ASSERT_TRUE(test::comes_true([&] { return is_fresh(rig.device); }));
        EXPECT_EQ(rig.device.counts().zeroings, 1u);
        EXPECT_GE(rig.board_says([&] { return rig.board.counters_set; }), 1)
            << "once more where its answer takes long";
        EXPECT_EQ(rig.board_says([&] { return rig.board.counters; }),
                  (std::array<int, 6>{8327, -10926, 27140, 0, 30, 0}));
        const auto home = wooden_pose(model, wooden_angles(model, model.home_counts));
        EXPECT_LT(glm::length(state_of(rig.device).position - home->position), 1e-15);
    }
}

TEST(WoodenDevice, Case12CalibrationButtonSetsTheCountersAgain) {
    WoodenDevice::Settings settings = patient();
    settings.start = WoodenStart::as_kept;
    Rig rig(14, settings, "polhem_v3");
    const WoodenModel model = wooden_model("polhem_v3");
    const auto at = [&](std::array<double, 6> counts) {
        return wooden_pose(model, wooden_angles(model, counts))->position;
    };
    rig.board_says([&] { rig.board.power_on_counters = {8000, -11000, 27000, 0, 30, 0}; });
    rig.node.plug_in();
    rig.device.open();
    rig.device.start();
    // As the device has kept them.
    ASSERT_TRUE(test::comes_true([&] { return is_fresh(rig.device); }));
    EXPECT_LT(glm::length(state_of(rig.device).position - at({8000, -11000, 27000, 0, 30, 0})),
              1e-15);
    EXPECT_EQ(rig.device.counts().zeroings, 0u);

    const std::uint32_t trial = state_of(rig.device).trial;
    rig.board_says([&] { rig.board.calibration_button = true; });
    ASSERT_TRUE(test::comes_true([&] { return rig.device.counts().zeroings == 1; }));
    EXPECT_FALSE(rig.board_says([&] { return rig.board.calibration_button; }));
    ASSERT_TRUE(test::comes_true([&] { return state_of(rig.device).trial == trial + 1; }));
    EXPECT_LT(glm::length(state_of(rig.device).position - at(model.home_counts)), 1e-15);
}

TEST(WoodenDevice, Case12NoForceWhileCountersAreSet) {
    Rig rig(14);
    rig.device.open();
    rig.device.start();
    ASSERT_TRUE(rig.push_until({0.0, 0.0, 1.0}, [&] { return rig.board.milliamps[2] != 0; }));
    rig.board_says([&] {
        rig.board.calibration_button = true;
        rig.board.milliamps = {1, 1, 1};
    });
    ASSERT_TRUE(rig.push_until({0.0, 0.0, 1.0}, [&] { return rig.board.counters_set >= 1; }));
    EXPECT_TRUE(test::comes_true([&] { return rig.device.counts().zeroings == 1; }));
    EXPECT_TRUE(test::comes_true([&] { return is_fresh(rig.device); }));
    EXPECT_LT(glm::length(state_of(rig.device).position - kHome), 1e-15);
}

TEST(WoodenDevice, ButtonOfTheHandleIsReported) {
    Rig rig(14, patient(), "polhem_v1");
    rig.device.open();
    rig.device.start();
    ASSERT_TRUE(test::comes_true([&] { return is_fresh(rig.device); }));
    EXPECT_EQ(state_of(rig.device).buttons, 0u);
    rig.board_says([&] { rig.board.counters[3] += 10000; });
    EXPECT_TRUE(test::comes_true([&] { return state_of(rig.device).buttons == 1; }));
    rig.board_says([&] { rig.board.counters[3] -= 10000; });
    EXPECT_TRUE(test::comes_true([&] { return state_of(rig.device).buttons == 0; }));
}

TEST(WoodenDevice, PoseOutOfReachIsNotPublished) {
    WoodenDevice::Settings settings = watchful();
    settings.start = WoodenStart::as_kept;
    Rig rig(14, settings, "polhem_v3");
    rig.board_says([&] { rig.board.power_on_counters = {8327, -10926, 27140, 0, 30, 0}; });
    rig.node.plug_in();
    rig.device.open();
    rig.device.start();
    ASSERT_TRUE(test::comes_true([&] { return is_fresh(rig.device); }));
    const Vec3 before = state_of(rig.device).position;
    // Link 1 back over the base and the crank towards it: links 3 and 4 are too short.
    rig.board_says([&] { rig.board.counters = {8327, -15754, 20481, 0, 30, 0}; });
    ASSERT_TRUE(test::comes_true([&] { return !is_fresh(rig.device); }));
    EXPECT_EQ(state_of(rig.device).position, before);
    EXPECT_GT(rig.device.counts().rejected_reports, 0u);
    rig.board_says([&] { rig.board.counters = {8327, -10926, 27140, 0, 30, 0}; });
    EXPECT_TRUE(test::comes_true([&] { return is_fresh(rig.device); }));
}

TEST(WoodenDevice, DevicesOfOtherKindsAreRefused) {
    class Keyboard final : public test::HidFirmware {
    public:
        int received = 0;
        test::Bytes descriptor() const override { return {0x05, 0x01, 0x09, 0x06, 0xC0}; }
        void power_on(double) override {}
        void receive(std::span<const std::uint8_t>, double) override { ++received; }
        std::optional<test::Bytes> send(double time_s) override {
            if (time_s < next_s) return std::nullopt;
            next_s = time_s + 0.001;
            return test::Bytes(14, 0);
        }
        double next_s = 0.0;
    };
    Keyboard keyboard;
    HidNode node(kPath, keyboard);
    WoodenDevice device(wooden_model("woodenhaptics_v2015"), patient());
    EXPECT_THROW(device.open(), std::runtime_error);
    EXPECT_EQ(node.at_rest([&] { return keyboard.received; }), 0) << "it was written to";
}

#ifdef PALPATE_HAS_SYSTEM_CALL_FILTER
TEST(WoodenDevice, ReadingAndWritingMakeNoSystemCall) {
    Rig rig(14);
    rig.device.open();
    rig.device.start();
    ASSERT_TRUE(test::comes_true([&] { return is_fresh(rig.device); }));
    test::expect_no_system_calls(rig.device);
}
#endif

TEST(WoodenDevice, DeclaresWhatItHolds) {
    const WoodenDevice device(wooden_model("woodenhaptics_v2015"), patient());
    const DeviceProperties properties = device.properties();
    EXPECT_NEAR(properties.force_n, 2.536, 5e-4);
    EXPECT_EQ(properties.stiffness_n_per_m, 1000.0);
    EXPECT_EQ(properties.damping_n_s_per_m, 0.5);
    EXPECT_NEAR(glm::distance(properties.workspace_m.upper, Vec3(0.1, 0.1, kHome.z)), 0.0, 1e-15);
}

TEST(WoodenDevice, NotOpenedItIsStaleAndTakesForcesWithoutHarm) {
    WoodenDevice device(wooden_model("woodenhaptics_v2015"), patient());
    EXPECT_EQ(state_of(device).freshness, Freshness::stale);
    device.write({1.0, 0.0, 0.0});
    device.stop();
    device.close();
    EXPECT_THROW(device.open(), std::runtime_error);
    EXPECT_EQ(state_of(device).freshness, Freshness::stale);
}

TEST(WoodenDevice, SettingsThatCannotBeAreRefused) {
    const WoodenModel model = wooden_model("woodenhaptics_v2015");
    for (const double odd : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
        WoodenDevice::Settings settings = patient();
        settings.stale_after_s = odd;
        EXPECT_THROW(WoodenDevice(model, settings), std::invalid_argument);
        settings = patient();
        settings.force_hold_s = odd;
        EXPECT_THROW(WoodenDevice(model, settings), std::invalid_argument);
        settings = patient();
        settings.reconnect_s = odd;
        EXPECT_THROW(WoodenDevice(model, settings), std::invalid_argument);
    }
}

TEST(WoodenDevice, DeclaresWhatItsPositionsAreRoundedToAndItsDelay) {
    const WoodenDevice device(wooden_model("woodenhaptics_v2015"), patient());
    // A count of C is the coarsest: 2 pi / 2000 x 0.01 / 0.12 at 245 mm.
    EXPECT_NEAR(device.properties().position_step_m, 64.14e-6, 1e-8);
    EXPECT_DOUBLE_EQ(device.properties().delay_s, 2e-3);
}

} // namespace
} // namespace palpate
