// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/internal/pid_reports.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include <tests/support/hid_descriptors.h>

namespace {

using namespace palpate::internal;
using palpate::test::kAdapterLayout;
using palpate::test::kBoardLayout;

using Bytes = std::vector<std::uint8_t>;

PidReports reports(const palpate::test::PidLayout& layout) {
    return {read_hid_descriptor(palpate::test::pid_descriptor(layout), "/dev/hidraw3"),
            "/dev/hidraw3"};
}

TEST(PidReports, AnAdapterGetsItsBytes) {
    const PidReports adapter = reports(kAdapterLayout);
    EXPECT_EQ(adapter.control(PidControl::reset), (Bytes{0x0C, 4}));
    EXPECT_EQ(adapter.control(PidControl::enable_actuators), (Bytes{0x0C, 1}));
    EXPECT_EQ(adapter.control(PidControl::disable_actuators), (Bytes{0x0C, 2}));
    EXPECT_EQ(adapter.control(PidControl::stop_all), (Bytes{0x0C, 3}));
    EXPECT_EQ(adapter.full_gain(), (Bytes{0x0D, 255}));
    // The second of the effect types is the constant force here.
    EXPECT_EQ(adapter.create_constant_force(), (Bytes{0x05, 2, 0, 0}));
    EXPECT_EQ(adapter.block_load_request(), (Bytes{0x06, 0, 0, 0, 0}));
    EXPECT_EQ(adapter.constant_force(7, 1.0), (Bytes{0x05, 7, 255, 0}));
    EXPECT_EQ(adapter.constant_force(7, -1.0), (Bytes{0x05, 7, 0x01, 0xFF}));
    EXPECT_EQ(adapter.operation(7, PidOperation::start), (Bytes{0x0A, 7, 1, 1}));
    EXPECT_EQ(adapter.operation(7, PidOperation::stop), (Bytes{0x0A, 7, 3, 1}));
    EXPECT_EQ(adapter.free_block(7), (Bytes{0x0B, 7}));
    // Number, type, duration, repeat, sample, gain, trigger, enable bits, directions: 270 degrees
    // of 360 is 135 of 180.
    EXPECT_EQ(adapter.set_effect(1, PidAxis::x),
              (Bytes{0x01, 1, 2, 0xFF, 0x7F, 0, 0, 0, 0, 255, 255, 0x04, 135, 0}));
    EXPECT_EQ(adapter.set_effect(2, PidAxis::y),
              (Bytes{0x01, 2, 2, 0xFF, 0x7F, 0, 0, 0, 0, 255, 255, 0x04, 0, 0}));
}

TEST(PidReports, ABoardWithOtherIdsAndWidthsGetsItsOwn) {
    const PidReports board = reports(kBoardLayout);
    EXPECT_EQ(board.control(PidControl::enable_actuators), (Bytes{0x0C, 0x01}));
    EXPECT_EQ(board.control(PidControl::reset), (Bytes{0x0C, 0x08})) << "bits, not a choice";
    EXPECT_EQ(board.create_constant_force(), (Bytes{0x11, 2, 0, 0}));
    EXPECT_EQ(board.block_load_request(), (Bytes{0x12, 0, 0, 0, 0}));
    EXPECT_EQ(board.constant_force(1, 1.0), (Bytes{0x05, 1, 0xFF, 0x7F}));
    EXPECT_EQ(board.constant_force(1, -0.5), (Bytes{0x05, 1, 0x00, 0xC0})) << "-16384";
    // 27000 of 36000, in 16 bits, after a start delay.
    EXPECT_EQ(board.set_effect(1, PidAxis::x),
              (Bytes{0x01, 1,   2,    0xFF, 0x7F, 0, 0, 0, 0, 0, 0,
                     255,  255, 0x04, 0x78, 0x69, 0, 0, 0, 0, 0, 0}));
}

// Held within the field's range it would be a button that there is, and the effect would wait for
// it.
TEST(PidReports, NoButtonIsANumberOutsideOfTheFieldsRange) {
    struct Case {
        std::int32_t first, last;
        std::uint8_t no_button;
    };
    for (const Case& one : {Case{1, 8, 0}, Case{0, 8, 255}}) {
        palpate::test::PidLayout layout = kAdapterLayout;
        layout.first_button = one.first;
        layout.last_button = one.last;
        EXPECT_EQ(reports(layout).set_effect(1, PidAxis::x),
                  (Bytes{0x01, 1, 2, 0xFF, 0x7F, 0, 0, 0, 0, 255, one.no_button, 0x04, 135, 0}))
            << "buttons from " << one.first;
    }
}

TEST(PidReports, MagnitudesAreClampedAndNotANumberIsNoForce) {
    const PidReports board = reports(kBoardLayout);
    EXPECT_EQ(board.constant_force(1, 17.0), board.constant_force(1, 1.0));
    EXPECT_EQ(board.constant_force(1, -1e300), board.constant_force(1, -1.0));
    for (const double bad :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
        EXPECT_EQ(board.constant_force(1, bad), board.constant_force(1, 0.0));
}

TEST(PidReports, BlockLoadTellsLoadedFullAndNonsenseApart) {
    const PidReports adapter = reports(kAdapterLayout);
    const PidBlockLoad loaded = adapter.block_load(Bytes{0x06, 9, 1, 0, 4});
    EXPECT_EQ(loaded.status, PidLoadStatus::loaded);
    EXPECT_EQ(loaded.effect, 9);
    EXPECT_EQ(adapter.block_load(Bytes{0x06, 0, 2, 0, 0}).status, PidLoadStatus::full);
    EXPECT_EQ(adapter.block_load(Bytes{0x06, 0, 3, 0, 0}).status, PidLoadStatus::failed);
    EXPECT_EQ(adapter.block_load(Bytes{0x06, 0, 1, 0, 0}).status, PidLoadStatus::failed)
        << "loaded, but there is no effect 0";
    EXPECT_EQ(adapter.block_load(Bytes{0x07, 9, 1, 0, 4}).status, PidLoadStatus::failed);
    EXPECT_EQ(adapter.block_load(Bytes{0x06, 9}).status, PidLoadStatus::failed);
    EXPECT_EQ(adapter.block_load(Bytes{}).status, PidLoadStatus::failed);
}

TEST(PidReports, StickAndButtonsAreReadFromTheirReportAlone) {
    const PidReports board = reports(kBoardLayout);
    // Buttons 1 and 8; x at its right end, y half way away from the user.
    const Bytes report = {0x01, 0x81, 0xFF, 0x7F, 0x00, 0xC0};
    const auto stick = board.stick(report);
    ASSERT_TRUE(stick);
    EXPECT_DOUBLE_EQ(stick->x, 1.0);
    EXPECT_NEAR(stick->y, -0.5, 1.0 / 32767.0) << "a count";
    EXPECT_EQ(board.buttons(report), 0x81u);
    EXPECT_FALSE(board.stick(Bytes{0x02, 0x81, 0xFF, 0x7F, 0x00, 0xC0})) << "the state report";
    EXPECT_FALSE(board.buttons(Bytes{0x02, 0x03}));
    EXPECT_FALSE(board.stick(Bytes{0x01, 0x81, 0xFF, 0x7F, 0x00}));
    // -32768 is below the logical minimum.
    EXPECT_DOUBLE_EQ(board.stick(Bytes{0x01, 0, 0x00, 0x80, 0, 0})->x, -1.0);
}

TEST(PidReports, WhateverComesTheStickIsWithinOneAndEffectsHaveNumbers) {
    std::mt19937 random(1);
    for (const auto& layout : {kAdapterLayout, kBoardLayout}) {
        const PidReports device = reports(layout);
        for (int round = 0; round < 20'000; ++round) {
            Bytes report(random() % 10);
            for (std::uint8_t& byte : report)
                byte = static_cast<std::uint8_t>(random());
            if (!report.empty()) report[0] %= 32;
            if (const auto stick = device.stick(report)) {
                ASSERT_LE(std::abs(stick->x), 1.0);
                ASSERT_LE(std::abs(stick->y), 1.0);
            }
            const PidBlockLoad load = device.block_load(report);
            ASSERT_EQ(load.status == PidLoadStatus::loaded, load.effect != 0);
        }
    }
}

// What says that its forces are longer than any report on USB is no device, and would be written
// past the end of the writer's room.
TEST(PidReports, ReportsThatNothingSendsAtOnceAreRefused) {
    palpate::test::PidLayout layout = kAdapterLayout;
    layout.padding_bytes = 1000;
    EXPECT_EQ(reports(layout).constant_force(1, 0.0).size(), 1004u);
    layout.padding_bytes = 2000;
    try {
        reports(layout);
        FAIL() << "taken";
    } catch (const std::runtime_error& error) {
        EXPECT_EQ(std::string(error.what()),
                  "/dev/hidraw3: its report 5 has more than 1025 bytes, which nothing on USB sends "
                  "at once; it cannot be used for force");
    }
}

TEST(PidReports, ADeviceWithoutConstantForcesIsRefusedByName) {
    const auto mouse = palpate::test::space_mouse_descriptor(true);
    try {
        PidReports(read_hid_descriptor(mouse, "/dev/hidraw3"), "/dev/hidraw3");
        FAIL() << "taken";
    } catch (const std::runtime_error& error) {
        EXPECT_NE(
            std::string(error.what()).find("/dev/hidraw3: its report descriptor has no Create"),
            std::string::npos)
            << error.what();
    }
}

} // namespace
