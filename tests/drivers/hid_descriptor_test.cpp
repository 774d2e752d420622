// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/internal/hid_descriptor.h>

#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include <tests/support/hid_descriptors.h>

namespace {

using namespace palpate::internal;
using palpate::test::DescriptorWriter;

using Bytes = std::vector<std::uint8_t>;

HidDescriptor read(const Bytes& bytes) { return read_hid_descriptor(bytes, "/dev/hidraw7"); }

/// As the boards of the WoodenHaptics have it: not numbered, 14 bytes each way, and a logical
/// maximum that is -1 to a reader that takes it as signed.
const Bytes kBoard = {0x06, 0xAB, 0xFF, 0x0A, 0x00, 0x02, 0xA1, 0x01, 0x75,
                      0x08, 0x15, 0x00, 0x25, 0xFF, 0x95, 0x0E, 0x09, 0x01,
                      0x81, 0x02, 0x95, 0x0E, 0x09, 0x02, 0x91, 0x02, 0xC0};

TEST(HidDescriptor, VendorBoardHasFourteenUnsignedBytesEachWay) {
    const HidDescriptor found = read(kBoard);
    EXPECT_FALSE(found.numbered);
    EXPECT_EQ(found.report_bytes(HidReportKind::input, 0), 14u);
    EXPECT_EQ(found.report_bytes(HidReportKind::output, 0), 14u);
    EXPECT_EQ(found.report_bytes(HidReportKind::feature, 0), 0u);
    ASSERT_EQ(found.fields.size(), 2u);
    EXPECT_EQ(found.fields[0].usages, std::vector<HidUsage>{hid_usage(0xFFAB, 1)});
    EXPECT_EQ(found.fields[0].count, 14u);
    EXPECT_EQ(found.fields[0].logical_max, 255);
    Bytes report(14, 0);
    report[13] = 0xC8;
    EXPECT_EQ(value_of(found.fields[0], report, 13), 200);
}

TEST(HidDescriptor, NumberedReportsCountTheirNumberAsAByte) {
    const HidDescriptor wired = read(palpate::test::space_mouse_descriptor(false));
    EXPECT_TRUE(wired.numbered);
    EXPECT_EQ(wired.report_bytes(HidReportKind::input, 1), 7u);
    EXPECT_EQ(wired.report_bytes(HidReportKind::input, 2), 7u);
    EXPECT_EQ(wired.report_bytes(HidReportKind::input, 3), 3u);
    EXPECT_EQ(wired.report_bytes(HidReportKind::output, 4), 2u);
    EXPECT_EQ(wired.longest_report(HidReportKind::input), 7u);
    EXPECT_EQ(
        read(palpate::test::space_mouse_descriptor(true)).report_bytes(HidReportKind::input, 1),
        13u);
}

TEST(HidDescriptor, ValuesAreTwosComplementWhereTheMinimumIsNegative) {
    const HidDescriptor mouse = read(palpate::test::space_mouse_descriptor(false));
    const HidField* ry = mouse.find(HidReportKind::input, hid_usage(0x01, 0x34));
    ASSERT_NE(ry, nullptr);
    EXPECT_EQ(value_of(*ry, Bytes{0x02, 0x00, 0x00, 0xE2, 0xFF, 0x00, 0x00}), -30);
    EXPECT_FALSE(value_of(*ry, Bytes{0x02, 0x00, 0x00, 0xE2})) << "cut off inside the value";
}

TEST(HidDescriptor, ArraysSayByTheirPlaceWhatVariablesSayByABit) {
    const HidDescriptor choice = read(palpate::test::pid_descriptor(palpate::test::kAdapterLayout));
    const HidDescriptor bits = read(palpate::test::pid_descriptor(palpate::test::kBoardLayout));
    const HidUsage stop_all = hid_usage(0x0F, 0x99);
    const HidField* chosen = choice.find(HidReportKind::output, stop_all);
    const HidField* bit = bits.find(HidReportKind::output, stop_all);
    ASSERT_TRUE(chosen != nullptr && bit != nullptr);
    EXPECT_EQ(choice_of(*chosen, stop_all), 3);
    EXPECT_EQ(choice_of(*bit, stop_all), 1);
    EXPECT_EQ(bit->first_bit, 8u + 2u);
    EXPECT_FALSE(choice_of(*bit, hid_usage(0x0F, 0x9A)));
}

TEST(HidDescriptor, AUsageOnAPageOfItsOwnLeavesThePageInForce) {
    const HidDescriptor found = read(palpate::test::pid_descriptor(palpate::test::kBoardLayout));
    EXPECT_NE(found.find(HidReportKind::output, hid_usage(0x0A, 2), hid_usage(0x0F, 0x58)),
              nullptr);
    EXPECT_NE(found.find(HidReportKind::output, hid_usage(0x0F, 0x70), hid_usage(0x0F, 0x73)),
              nullptr);
}

TEST(HidDescriptor, PushedStatesComeBack) {
    DescriptorWriter w;
    w.page(0x01).begin(0x04, DescriptorWriter::application).range(0, 255).values(8, 1);
    w.push().values(16, 2).usage(0x30).input().pop().usage(0x31).input().end();
    EXPECT_EQ(read(w.bytes()).report_bytes(HidReportKind::input, 0), 5u);
}

TEST(HidDescriptor, LongItemsArePassedOver) {
    Bytes bytes = {0xFE, 0x03, 0x10, 0xAA, 0xBB, 0xCC};
    bytes.insert(bytes.end(), kBoard.begin(), kBoard.end());
    EXPECT_EQ(read(bytes).report_bytes(HidReportKind::input, 0), 14u);
}

TEST(HidDescriptor, WhatIsWrittenIsReadAndNothingBesideItChanges) {
    std::mt19937 random(20'261'121);
    for (int round = 0; round < 2000; ++round) {
        HidField field;
        field.bits = 1 + random() % 32;
        field.first_bit = random() % 70;
        field.count = 1 + random() % 4;
        const bool with_sign = random() % 2 == 0 && field.bits > 1;
        const std::int64_t most = (std::int64_t{1} << (field.bits - (with_sign ? 1 : 0))) - 1;
        field.logical_min = with_sign ? -most - 1 : 0;
        field.logical_max = most;
        const std::int64_t span = field.logical_max - field.logical_min + 1;
        const auto value = field.logical_min +
                           static_cast<std::int64_t>((std::uint64_t{random()} << 32 | random()) %
                                                     static_cast<std::uint64_t>(span));
        const std::uint32_t index = random() % field.count;
        Bytes before(32);
        for (std::uint8_t& byte : before)
            byte = static_cast<std::uint8_t>(random());
        Bytes after = before;
        set_value(field, after, value, index);
        EXPECT_EQ(value_of(field, after, index), value);
        set_value(field, after, *value_of(field, before, index), index);
        EXPECT_EQ(after, before) << "round " << round;
    }
}

TEST(HidDescriptor, ValuesOutOfRangeAreClampedAndShortReportsLeftAlone) {
    HidField field;
    field.bits = 16;
    field.logical_min = -255;
    field.logical_max = 255;
    Bytes report(2, 0);
    set_value(field, report, 100'000);
    EXPECT_EQ(value_of(field, report), 255);
    set_value(field, report, -100'000);
    EXPECT_EQ(value_of(field, report), -255);
    Bytes too_short(1, 0x55);
    set_value(field, too_short, 3);
    EXPECT_EQ(too_short, Bytes{0x55});
    EXPECT_FALSE(value_of(field, report, 1)) << "there is one value only";
}

struct Garbage {
    const char* what;
    Bytes bytes;
};

TEST(HidDescriptor, GarbageIsRefusedWithDeviceByteAndRemedy) {
    const Garbage cases[] = {
        {"it is empty", {}},
        {"an item is cut off", {0x06, 0xAB}},
        {"a long item is cut off", {0xFE}},
        {"a long item is cut off", {0xFE, 0x05, 0x00, 0x01}},
        {"it ends inside a collection", {0x05, 0x01, 0x09, 0x04, 0xA1, 0x01}},
        {"a collection ends that has not begun", {0xC0}},
        {"a state is popped that was not pushed", {0xB4}},
        {"a report's id is not from 1 to 255", {0x85, 0x00}},
        {"a value is outside of any collection", {0x75, 0x08, 0x95, 0x01, 0x09, 0x01, 0x81, 0x02}},
        {"it has no reports", {0x05, 0x01, 0x09, 0x04, 0xA1, 0x01, 0xC0}},
        {"a value is wider than any report", {0x77, 0xFF, 0xFF, 0xFF, 0x7F}},
        {"a report is longer than any report may be",
         {0xA1, 0x01, 0x76, 0xFF, 0xFF, 0x96, 0xFF, 0xFF, 0x81, 0x02, 0xC0}},
        {"an item has too many usages", {0xA1, 0x01, 0x1A, 0x00, 0x00, 0x2A, 0xFF, 0xFF, 0xC0}},
        {"collections are too deep", Bytes(80, 0xA0)},
        {"states are pushed too deep", Bytes(80, 0xA4)},
        {"some reports have ids and some have not",
         {0xA1, 0x01, 0x75, 0x08, 0x95, 0x01, 0x09, 0x01, 0x81, 0x02, 0x85, 0x02, 0xC0}},
        {"of at most 4096", Bytes(4097, 0xC0)},
    };
    for (const Garbage& garbage : cases) {
        try {
            read(garbage.bytes);
            ADD_FAILURE() << "taken: " << garbage.what;
        } catch (const std::runtime_error& error) {
            const std::string said = error.what();
            EXPECT_NE(said.find("/dev/hidraw7: "), std::string::npos) << said;
            EXPECT_NE(said.find(garbage.what), std::string::npos) << said;
            EXPECT_NE(said.find("; the device cannot be used"), std::string::npos) << said;
        }
    }
}

/// Every field of a descriptor that was taken can be read from and written to reports of its size.
void use_all(const HidDescriptor& found) {
    for (const HidField& field : found.fields) {
        Bytes report(found.report_bytes(field.kind, field.report_id), 0xFF);
        for (const std::uint32_t index : {0u, field.count - 1}) {
            ASSERT_TRUE(value_of(field, report, index));
            set_value(field, report, 0, index);
        }
        ASSERT_FALSE(value_of(field, report, field.count));
        ASSERT_FALSE(field.usages.empty());
        ASSERT_LT(field.collection, found.collections.size());
    }
}

TEST(HidDescriptor, CutOffAnywhereItIsRefused) {
    for (const Bytes& whole : {kBoard, palpate::test::space_mouse_descriptor(true),
                               palpate::test::pid_descriptor(palpate::test::kAdapterLayout),
                               palpate::test::pid_descriptor(palpate::test::kBoardLayout)}) {
        EXPECT_NO_THROW(use_all(read(whole)));
        for (std::size_t length = 0; length < whole.size(); ++length)
            EXPECT_THROW(read(Bytes(whole.begin(), whole.begin() + static_cast<long>(length))),
                         std::runtime_error)
                << length;
    }
}

TEST(HidDescriptor, RandomDamageIsRefusedOrWithinItsOwnReports) {
    std::mt19937 random(42);
    const Bytes whole = palpate::test::pid_descriptor(palpate::test::kBoardLayout);
    int taken = 0;
    for (int round = 0; round < 20'000; ++round) {
        Bytes bytes = whole;
        if (round % 2 == 0) { // noise
            bytes.resize(random() % 200);
            for (std::uint8_t& byte : bytes)
                byte = static_cast<std::uint8_t>(random());
        } else { // a real one with some bytes wrong
            for (unsigned i = 0; i < 1 + random() % 4; ++i)
                bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
        }
        try {
            use_all(read(bytes));
            ++taken;
        } catch (const std::runtime_error&) {
        }
    }
    EXPECT_GT(taken, 1000) << "the damage must leave some that are still descriptors";
}

} // namespace
