// SPDX-License-Identifier: Apache-2.0
#include <random>

#include <gtest/gtest.h>

#include <palpate/drivers/internal/wooden_codec.h>

#include "tests/support/wooden_firmware.h"

namespace palpate::internal {
namespace {

using Bytes = test::Bytes;
using Counters = std::array<std::int16_t, 6>;

Bytes currents(WoodenLayout layout, const std::array<std::int16_t, 3>& milliamps) {
    std::array<std::uint8_t, kWoodenBuffer> report{};
    report.fill(0xEE);
    const std::size_t size = encode_wooden_currents(layout, milliamps, report);
    return {report.begin(), report.begin() + static_cast<std::ptrdiff_t>(size)};
}

TEST(WoodenCodec, CurrentsAreTheBytesOfTheProtocol) {
    const Bytes expected{0x00, 0x7b, 0x00, 0x38, 0xfe, 0xcf, 0x07, 0, 0, 0, 0, 0, 0, 0, 0};
    EXPECT_EQ(currents(WoodenLayout::bytes_14, {123, -456, 1999}), expected);
    EXPECT_EQ(currents(WoodenLayout::bytes_8, {123, -456, 1999}),
              Bytes(expected.begin(), expected.begin() + 9));
    Bytes padded = expected;
    padded.resize(65, 0);
    EXPECT_EQ(currents(WoodenLayout::bytes_64, {123, -456, 1999}), padded);
}

TEST(WoodenCodec, CountersAreTheBytesOfTheProtocol) {
    const Bytes bytes{0xf4, 0x01, 0xe8, 0x03, 0x70, 0x17, 0, 0, 0, 0, 0, 0, 0x01, 0x00};
    const auto report = decode_wooden(WoodenLayout::bytes_14, bytes);
    ASSERT_TRUE(report);
    EXPECT_EQ(report->counters, (Counters{500, 1000, 6000, 0, 0, 0}));
    EXPECT_TRUE(report->asks_for_zero);
    EXPECT_FALSE(report->button);

    const Bytes of_8{0xff, 0xff, 0x00, 0x80, 0xff, 0x7f, 0x34, 0x12};
    const auto free_running = decode_wooden(WoodenLayout::bytes_8, of_8);
    ASSERT_TRUE(free_running);
    EXPECT_EQ(free_running->counters, (Counters{-1, -32768, 32767, 0, 0, 0}));
    EXPECT_EQ(free_running->sequence, 0x1234);
}

TEST(WoodenCodec, GimbalComesInReverseOrder) {
    // Fields d, e, f of the board are 1, 2, 3.
    const Bytes bytes{0, 0, 0, 0, 0, 0, 1, 0, 2, 0, 3, 0, 0, 0};
    EXPECT_EQ(decode_wooden(WoodenLayout::bytes_14, bytes)->counters, (Counters{0, 0, 0, 3, 2, 1}));
}

TEST(WoodenCodec, ButtonIsTakenOutOfItsCounter) {
    Bytes bytes(14, 0);
    bytes[6] = static_cast<std::uint8_t>((10000 - 321) & 0xFF);
    bytes[7] = static_cast<std::uint8_t>((10000 - 321) >> 8);
    const auto report = decode_wooden(WoodenLayout::bytes_14, bytes);
    EXPECT_TRUE(report->button);
    EXPECT_EQ(report->counters[5], -321);
}

TEST(WoodenCodec, OnlyTheLayoutsOwnLengthIsDecoded) {
    for (const auto layout :
         {WoodenLayout::bytes_8, WoodenLayout::bytes_14, WoodenLayout::bytes_64})
        for (std::size_t length = 0; length <= 70; ++length)
            EXPECT_EQ(decode_wooden(layout, Bytes(length, 1)).has_value(),
                      length == static_cast<std::size_t>(layout));
}

TEST(WoodenCodec, LayoutIsTheLengthOfTheFirstReport) {
    for (std::size_t length = 0; length <= 70; ++length) {
        const auto layout = wooden_layout(length);
        EXPECT_EQ(layout.has_value(), length == 8 || length == 14 || length == 64);
        EXPECT_TRUE(!layout || static_cast<std::size_t>(*layout) == length);
    }
}

std::optional<WoodenLayout> layout_declared_by(const Bytes& descriptor) {
    return wooden_layout(read_hid_descriptor(descriptor, "board"));
}

TEST(WoodenCodec, DescriptorTellsTheFamilyFromOthers) {
    for (const std::size_t size : {8, 14, 64})
        EXPECT_EQ(layout_declared_by(test::WoodenFirmware(size).descriptor()), wooden_layout(size));
    const auto layout_with = [](std::size_t at, std::uint8_t value) {
        Bytes changed = test::WoodenFirmware(14).descriptor();
        changed.at(at) = value;
        return layout_declared_by(changed);
    };
    EXPECT_TRUE(layout_with(15, 14));
    EXPECT_FALSE(layout_with(1, 0xAC)); // another usage page
    EXPECT_FALSE(layout_with(5, 0x03)); // another usage
    EXPECT_FALSE(layout_with(15, 13));  // another length
    EXPECT_FALSE(layout_with(21, 8));   // not the same both ways
    EXPECT_FALSE(layout_with(9, 16));   // not bytes
    EXPECT_FALSE(wooden_layout(HidDescriptor{}));
}

TEST(WoodenCodec, CountersThatAreSetComeBackAsTheyWere) {
    const std::uint32_t seed = 11;
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> any(-32768, 32767);
    std::uniform_int_distribution<int> below_button(-32768, 5000);
    for (const std::size_t size : {14, 64}) {
        test::WoodenFirmware board(size);
        board.power_on(0.0);
        board.calibration_button = true;
        for (int i = 0; i < 1000; ++i) {
            Counters counters{};
            for (auto& counter : counters)
                counter = static_cast<std::int16_t>(any(random));
            counters[5] = static_cast<std::int16_t>(below_button(random));
            std::array<std::uint8_t, kWoodenBuffer> bytes{};
            const std::size_t length =
                encode_wooden_counters(*wooden_layout(size), counters, bytes);
            ASSERT_EQ(length, size + 1);
            board.receive({bytes.data() + 1, size}, 0.001 * i);
            const auto report = decode_wooden(*wooden_layout(size), *board.send(0.001 * i + 0.001));
            ASSERT_EQ(report->counters, counters);
            ASSERT_FALSE(report->asks_for_zero);
        }
    }
    std::array<std::uint8_t, kWoodenBuffer> bytes{};
    EXPECT_EQ(encode_wooden_counters(WoodenLayout::bytes_8, {}, bytes), 0u);
}

TEST(WoodenCounters, AreFollowedOverTheEndOf16Bits) {
    // A twin in 32 bits, of which the board shows the low 16.
    const std::uint32_t seed = 12;
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> step(-32768, 32767);
    WoodenModel model;
    model.count_direction = {1, -1, 1, -1, 1, -1};
    std::array<int, 6> true_counters{30000, -30000, 0, 32767, -32768, 5};
    const auto shown = [&] {
        Counters counters{};
        for (std::size_t i = 0; i < 6; ++i)
            counters[i] = static_cast<std::int16_t>(static_cast<std::uint32_t>(true_counters[i]));
        return counters;
    };
    const auto start = true_counters;
    WoodenCounters counters;
    counters.set_home(model, shown());
    for (int k = 0; k < 2000; ++k) {
        for (auto& counter : true_counters)
            counter += step(random);
        counters.follow(shown());
        for (std::size_t i = 0; i < 6; ++i)
            ASSERT_EQ(counters.counts()[i],
                      model.count_direction[i] * double(true_counters[i] - start[i]));
    }
}

TEST(WoodenCounters, AtHomeTheyAreTheModelsWhateverTheBoardSays) {
    WoodenModel model;
    model.home_counts = {0, 0, 6000, 1, 2, 3};
    model.count_direction = {-1, -1, -1, 1, 1, 1};
    WoodenCounters counters;
    counters.set_home(model, {17, -4, 300, 9, 9, 9});
    EXPECT_EQ(counters.counts(), model.home_counts);
    counters.follow({27, -4, 300, 10, 9, 9});
    EXPECT_EQ(counters.counts(), (std::array<double, 6>{-10, 0, 6000, 2, 2, 3}));

    model.count_direction = {1, 1, 1, 1, 1, 1};
    counters.set_kept(model, {17, -4, 300, 9, 9, 9});
    EXPECT_EQ(counters.counts(), (std::array<double, 6>{17, -4, 300, 9, 9, 9}));
}

} // namespace
} // namespace palpate::internal
