// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <limits>

#include <gtest/gtest.h>

#include <palpate/drivers/internal/hid_stream.h>
#include <palpate/drivers/internal/newest_value.h>

#include "tests/drivers/hid_node.h"
#include "tests/support/patience.h"

namespace palpate::internal {
namespace {

using std::chrono::milliseconds;
using test::Bytes;
using test::HidNode;
using test::WriteFault;

const std::string kPath = test::node_path("stream");

/// Sends, every ms, how many reports it has sent before; 32 bits.
class CountingFirmware final : public test::HidFirmware {
public:
    std::uint32_t sent = 0;
    int received = 0;
    bool released = false;
    bool waits = false; ///< sends `wanted` reports, and no more
    int wanted = 0;

    Bytes descriptor() const override { return {0xC0}; }
    void power_on(double time_s) override { next_s_ = time_s; }
    void receive(std::span<const std::uint8_t> report, double) override {
        ++received;
        released = report[0] == 0xFF;
    }
    std::optional<Bytes> send(double time_s) override {
        if (time_s < next_s_ || (waits && wanted == 0)) return std::nullopt;
        if (waits) --wanted;
        next_s_ += 0.001;
        Bytes report(8, 0);
        for (std::size_t i = 0; i < 4; ++i)
            report[i] = static_cast<std::uint8_t>(sent >> (8 * i));
        ++sent;
        return report;
    }

private:
    double next_s_ = 0.0;
};

/// Notes what it is told; `hold` keeps the reader in received().
class NotingProtocol final : public HidProtocol {
public:
    std::atomic<bool> hold{false};
    std::atomic<bool> holding{false};
    std::atomic<std::uint32_t> newest{0}; ///< of those published
    std::atomic<std::uint32_t> published{0};
    std::atomic<std::uint32_t> out_of_order{0};
    std::atomic<std::uint32_t> composed{0};

    std::string find() override { return kPath; }
    void connected(HidPort&) override { last_ = 0; }
    void release(HidPort& port) noexcept override { port.write(Bytes{0, 0xFF}); }
    void received(std::span<const std::uint8_t> report, double) noexcept override {
        while (hold.load()) {
            holding = true;
            std::this_thread::sleep_for(milliseconds(1));
        }
        holding = false;
        std::uint32_t number = 0;
        for (std::size_t i = 0; i < 4; ++i)
            number |= static_cast<std::uint32_t>(report[i]) << (8 * i);
        if (number < last_) ++out_of_order;
        last_ = number;
    }
    void caught_up() noexcept override {
        newest = last_;
        ++published;
    }
    std::size_t compose(std::span<std::uint8_t> report) noexcept override {
        ++composed;
        report[0] = 0;
        report[1] = 0x11;
        return 2;
    }

private:
    std::uint32_t last_ = 0;
};

struct Rig {
    CountingFirmware firmware;
    HidNode node{kPath, firmware};
    NotingProtocol protocol;
    HidStream stream;

    explicit Rig(double trusted_s = std::numeric_limits<double>::infinity())
        : stream(protocol, {milliseconds(10), milliseconds(20), trusted_s}) {
        stream.open();
        stream.start();
    }
    std::uint32_t sent() {
        return node.at_rest([&] { return firmware.sent; });
    }
};

TEST(HidStream, ReportsAreGivenInOrderAndAnswered) {
    Rig rig;
    EXPECT_TRUE(test::comes_true([&] { return rig.protocol.newest > 200; }));
    EXPECT_TRUE(rig.node.wait_until([&] { return rig.firmware.received > 50; }));
    EXPECT_EQ(rig.protocol.out_of_order, 0u);
    EXPECT_EQ(rig.stream.counts().connections, 1u);
}

/// The queue's first report is the oldest and its last one is old, too, if it had filled up.
void expect_no_old_report_after_a_stall(int reports) {
    Rig rig;
    ASSERT_TRUE(test::comes_true([&] { return rig.protocol.published > 10; }));
    rig.protocol.hold = true;
    ASSERT_TRUE(test::comes_true([&] { return rig.protocol.holding.load(); }));
    const std::uint32_t from = rig.sent();
    ASSERT_TRUE(rig.node.wait_until(
        [&] { return rig.firmware.sent >= from + static_cast<std::uint32_t>(reports); }));
    const std::uint32_t overruns = rig.stream.counts().overruns;
    const std::uint32_t published = rig.protocol.published;
    const std::uint32_t sent = rig.sent();
    rig.protocol.hold = false;
    ASSERT_TRUE(test::comes_true([&] { return rig.protocol.published != published; }));
    EXPECT_GE(rig.protocol.newest, sent) << "a report of the time of the stall was published";
    EXPECT_GT(rig.stream.counts().overruns, overruns);
}

TEST(HidStream, Case7NothingOldIsPublishedAfterAStallOf70ms) {
    expect_no_old_report_after_a_stall(70);
}

TEST(HidStream, Case7NothingOldIsPublishedAfterAStallOf500ms) {
    expect_no_old_report_after_a_stall(500);
}

TEST(HidStream, Case7OneOldReportOfABoardThatWaitsIsNotPublishedAfterAStall) {
    constexpr double kTrusted = 0.2;
    Rig rig(kTrusted);
    const auto send_one = [&] { ++rig.firmware.wanted; };
    ASSERT_TRUE(test::comes_true([&] { return rig.protocol.published > 10; }));
    rig.node.at_rest([&] { rig.firmware.waits = true; });
    // The reader stalls over one report; another one comes early in the stall and grows old.
    rig.protocol.hold = true;
    rig.node.at_rest(send_one);
    ASSERT_TRUE(test::comes_true([&] { return rig.protocol.holding.load(); }));
    rig.node.at_rest(send_one);
    ASSERT_TRUE(rig.node.wait_until([&] { return rig.firmware.wanted == 0; }));
    std::this_thread::sleep_for(std::chrono::duration<double>(kTrusted + 0.01));
    const std::uint32_t published = rig.protocol.published;
    const std::uint32_t overruns = rig.stream.counts().overruns;
    rig.protocol.hold = false;
    ASSERT_TRUE(test::comes_true([&] { return rig.stream.counts().overruns > overruns; }));
    EXPECT_EQ(rig.protocol.published, published);
    rig.node.at_rest([&] { rig.firmware.waits = false; });
    EXPECT_TRUE(test::comes_true([&] { return rig.protocol.published > published; }));
}

TEST(HidStream, StartedAgainItDoesNotPublishWhatCameWhileItWasStopped) {
    Rig rig(0.2);
    ASSERT_TRUE(test::comes_true([&] { return rig.protocol.published > 10; }));
    rig.stream.stop();
    const std::uint32_t sent = rig.sent();
    ASSERT_TRUE(rig.node.wait_until([&] { return rig.firmware.sent > sent + 20; }));
    const std::uint32_t published = rig.protocol.published;
    const std::uint32_t until = rig.sent();
    rig.stream.start();
    ASSERT_TRUE(test::comes_true([&] { return rig.protocol.published > published; }));
    EXPECT_GE(rig.protocol.newest, until);
}

TEST(HidStream, StoppedItHasTakenTheForceAway) {
    Rig rig;
    ASSERT_TRUE(rig.node.wait_until([&] { return rig.firmware.received > 5; }));
    rig.stream.stop();
    EXPECT_TRUE(rig.node.wait_until([&] { return rig.firmware.released; }));
    const std::uint32_t composed = rig.protocol.composed;
    std::this_thread::sleep_for(milliseconds(30));
    EXPECT_EQ(rig.protocol.composed, composed);
    rig.stream.stop();
    rig.stream.start();
    EXPECT_TRUE(test::comes_true([&] { return rig.protocol.composed > composed + 5; }));
    rig.stream.close();
    rig.stream.close();
    EXPECT_TRUE(rig.node.wait_until([&] { return rig.firmware.released; }));
}

TEST(HidStream, Case9ComesBackWhenPluggedInAgain) {
    Rig rig;
    for (std::uint32_t i = 1; i <= 5; ++i) {
        ASSERT_TRUE(test::comes_true([&] { return rig.protocol.published > 20 * i; }));
        rig.node.unplug();
        ASSERT_TRUE(test::comes_true([&] { return rig.stream.counts().losses == i; }));
        rig.node.plug_in();
        ASSERT_TRUE(test::comes_true([&] { return rig.stream.counts().connections == i + 1; }));
    }
}

TEST(HidStream, Case9StoppedWhileTheDeviceIsAway) {
    Rig rig;
    rig.node.unplug();
    ASSERT_TRUE(test::comes_true([&] { return rig.stream.counts().losses == 1; }));
    rig.stream.close();
    EXPECT_EQ(rig.stream.counts().connections, 1u);
}

TEST(HidStream, Case10DeviceThatTakesNoReportHoldsTheWriterAlone) {
    Rig rig;
    ASSERT_TRUE(test::comes_true([&] { return rig.protocol.published > 10; }));
    EXPECT_EQ(rig.stream.counts().failed_writes, 0u);
    rig.node.set_write_fault(WriteFault::blocks);
    ASSERT_TRUE(
        test::comes_true([&] { return hid_time_s() - rig.stream.untaken_since_s() > 0.1; }));
    const std::uint32_t published = rig.protocol.published;
    EXPECT_TRUE(test::comes_true([&] { return rig.protocol.published > published + 50; }));
    EXPECT_GT(hid_time_s() - rig.stream.untaken_since_s(), 0.1);
    rig.node.set_write_fault(WriteFault::none);
    const std::uint32_t composed = rig.protocol.composed;
    EXPECT_TRUE(test::comes_true([&] { return rig.protocol.composed > composed + 5; }));
}

TEST(HidStream, Case10DeviceThatRefusesReportsIsOpenedAnew) {
    Rig rig;
    rig.node.set_write_fault(WriteFault::fails);
    ASSERT_TRUE(test::comes_true([&] { return rig.stream.counts().losses > 0; }));
    EXPECT_GE(rig.stream.counts().failed_writes, 5u);
    rig.node.set_write_fault(WriteFault::none);
    const std::uint32_t published = rig.protocol.published;
    EXPECT_TRUE(test::comes_true([&] { return rig.protocol.published > published + 50; }));
}

TEST(HidStream, Case9UnplugEndsABlockedWrite) {
    Rig rig;
    rig.node.set_write_fault(WriteFault::blocks);
    ASSERT_TRUE(
        test::comes_true([&] { return hid_time_s() - rig.stream.untaken_since_s() > 0.02; }));
    rig.node.unplug();
    EXPECT_TRUE(test::comes_true([&] { return rig.stream.counts().losses == 1; }));
}

TEST(NewestValue, TakerSeesWholeValuesInOrderAndTheLastOne) {
    struct Pair {
        std::uint64_t number, twice, thrice;
    };
    NewestValue<Pair> newest;
    constexpr std::uint64_t kLast = 200000;
    Pair taken{};
    EXPECT_FALSE(newest.take(taken));
    std::thread giver([&] {
        for (std::uint64_t i = 1; i <= kLast; ++i)
            newest.give({i, 2 * i, 3 * i});
    });
    std::uint64_t last = 0;
    while (last != kLast) {
        if (!newest.take(taken)) continue;
        ASSERT_EQ(taken.twice, 2 * taken.number);
        ASSERT_EQ(taken.thrice, 3 * taken.number);
        ASSERT_GT(taken.number, last);
        last = taken.number;
    }
    giver.join();
    EXPECT_FALSE(newest.take(taken));
    EXPECT_EQ(taken.number, kLast);
}

} // namespace
} // namespace palpate::internal
