// SPDX-License-Identifier: Apache-2.0
// Runs inside a virtual machine, as scripts/test_hidraw_qemu.sh starts it: our drivers on the real
// libhidapi, the real hidraw and the real USB stack, with firmware at the other end.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>

#include <sys/syscall.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include <palpate/drivers/attached_devices.h>
#include <palpate/drivers/internal/hid_stream.h>
#include <palpate/drivers/pid_device.h>
#include <palpate/drivers/space_mouse.h>
#include <palpate/drivers/wooden_device.h>
#include <tests/qemu/firmware_cable.h>
#include <tests/support/patience.h>
#include <tests/support/pid_firmware.h>
#include <tests/support/space_mouse_firmware.h>
#include <tests/support/wooden_firmware.h>

using namespace palpate;
using namespace palpate::test;
using namespace std::chrono_literals;

namespace {

/// WoodenHaptics of 2015 as its makers publish it.
WoodenModel model(WoodenZeroing zeroing) {
    WoodenModel made;
    made.name = "woodenhaptics_v2015";
    made.zeroing = zeroing;
    made.capstan_diameter_m = {0.010, 0.010, 0.010};
    made.body_diameter_m = {0.160, 0.120, 0.120};
    made.body_length_m = {0.080, 0.205, 0.245};
    made.workspace_origin_m = {0.220, 0.0, 0.080};
    made.torque_constant_nm_per_a = {0.0259, 0.0259, 0.0259};
    made.counts_per_turn = {2000, 2000, 2000, 0, 0, 0};
    made.home_counts = {0, 0, 6000, 0, 0, 0};
    return made;
}

const Vec3 kHome(0.025, 0.0, 0.205); // m, of that model

/// A board whose reports count, and that counts what it is sent: nothing may be missing.
class CountingFirmware final : public HidFirmware {
public:
    explicit CountingFirmware(std::size_t report_size) : board(report_size) {}

    WoodenFirmware board;
    int gaps = 0; ///< in what was received

    Bytes descriptor() const override { return board.descriptor(); }
    void power_on(double time_s) override { board.power_on(time_s); }
    void receive(std::span<const std::uint8_t> report, double time_s) override {
        board.receive(report, time_s);
        if (last_ >= 0 && board.milliamps[0] != (last_ + 1) % 1000) ++gaps;
        last_ = board.milliamps[0];
    }
    std::optional<Bytes> send(double time_s) override {
        auto report = board.send(time_s);
        if (report) board.counters[0] = (board.counters[0] + 1) % 30'000;
        return report;
    }

private:
    int last_ = -1;
};

/// Reads those counts on HidStream's threads, and sends its own.
class CountingProtocol final : public internal::HidProtocol {
public:
    explicit CountingProtocol(std::size_t report_size) : size_(report_size) {}

    std::atomic<int> reports{0};
    std::atomic<int> gaps{0};
    std::atomic<int> last{-1};
    std::atomic<int> stall_ms{0}; ///< once, while a report is taken

    std::string find() override {
        for (const AttachedDevice& device : attached_devices())
            if (device.kind == AttachedKind::wooden_haptics && device.usable()) return device.path;
        throw std::runtime_error("no board");
    }
    void connected(internal::HidPort& port) override {
        if (size_ > 8) port.write(Bytes(size_ + 1, 0)); // they wait to be answered
    }
    void release(internal::HidPort&) noexcept override {}
    void received(std::span<const std::uint8_t> report, double) noexcept override {
        const int count = report[0] | report[1] << 8;
        if (last >= 0 && count != (last + 1) % 30'000) ++gaps;
        last = count;
        ++reports;
        if (const int stall = stall_ms.exchange(0); stall > 0)
            std::this_thread::sleep_for(std::chrono::milliseconds(stall));
    }
    void caught_up() noexcept override {}
    std::size_t compose(std::span<std::uint8_t> report) noexcept override {
        std::fill(report.begin(), report.begin() + static_cast<long>(size_) + 1, 0);
        next_ = (next_ + 1) % 1000;
        report[1] = static_cast<std::uint8_t>(next_);
        report[2] = static_cast<std::uint8_t>(next_ >> 8);
        return size_ + 1;
    }

private:
    const std::size_t size_;
    int next_ = 0;
};

bool is_listed(AttachedKind kind) {
    for (const AttachedDevice& device : attached_devices())
        if (device.kind == kind && device.usable()) return true;
    return false;
}

void connect(FirmwareCable& cable, AttachedKind kind) {
    cable.plug_in();
    ASSERT_TRUE(comes_true([&] { return is_listed(kind); })) << "the kernel has made no node of it";
}

/// How a board is connected.
struct Wiring {
    const char* name;
    std::size_t report_size;
    std::uint16_t vendor, product;
    bool usb;
};

class Hidraw : public testing::TestWithParam<Wiring> {
protected:
    std::unique_ptr<FirmwareCable> cable(HidFirmware& firmware) const {
        const Wiring& to = GetParam();
        if (to.usb) return std::make_unique<GadgetCable>(firmware, to.vendor, to.product);
        return std::make_unique<UhidCable>(firmware, to.vendor, to.product);
    }

    static bool listed() { return is_listed(AttachedKind::wooden_haptics); }
    static void plug_in(FirmwareCable& cable) { connect(cable, AttachedKind::wooden_haptics); }
};

/// Boards whose counters the host can set, and boards that do not wait for an answer.
class SettableBoard : public Hidraw {};
class FreeRunningBoard : public Hidraw {};

TEST_P(Hidraw, TheBoardIsListedAsUsable) {
    WoodenFirmware board(GetParam().report_size);
    const auto usb = cable(board);
    EXPECT_FALSE(listed());
    plug_in(*usb);
    usb->pull_out();
    EXPECT_TRUE(comes_true([] { return !listed(); }));
}

TEST_P(Hidraw, TwoThousandFramesBothWaysWithoutAGap) {
    CountingFirmware firmware(GetParam().report_size);
    const auto usb = cable(firmware);
    plug_in(*usb);
    CountingProtocol protocol(GetParam().report_size);
    internal::HidStream stream(protocol, {});
    stream.open();
    const auto began = std::chrono::steady_clock::now();
    stream.start();
    EXPECT_TRUE(comes_true([&] {
        return protocol.reports >= 2000 &&
               usb->look([&] { return firmware.board.reports_received; }) >= 2000;
    })) << protocol.reports
        << " reports read";
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
    stream.stop();
    usb->look([&] {
        std::printf("    %d reports read, %d written in %.2f s: %.0f a second\n",
                    protocol.reports.load(), firmware.board.reports_received, took.count(),
                    protocol.reports / took.count());
        EXPECT_EQ(firmware.gaps, 0) << "of reports to the board";
        EXPECT_EQ(firmware.board.reports_ignored, 0);
    });
    EXPECT_EQ(protocol.gaps, 0) << "of reports from the board";
    EXPECT_EQ(stream.counts().failed_writes, 0u);
    EXPECT_EQ(stream.counts().overruns, 0u);
}

TEST_P(Hidraw, TheHandleIsAtHomeAndAForceReachesTheMotors) {
    WoodenFirmware board(GetParam().report_size);
    const auto usb = cable(board);
    plug_in(*usb);
    WoodenDevice device(model(WoodenZeroing::host), {});
    device.open();
    std::printf("    %s\n", device.properties().name.c_str());
    device.start();
    DeviceState state;
    const auto at_home = [&] {
        device.write({0.1, 0.2, -0.15}); // a tenth of the published example
        device.read(state);
        // Of the published currents, 1182.43, 659.59, -1182.43 mA, a tenth without its fraction.
        return state.freshness == Freshness::fresh &&
               usb->look([&] { return board.milliamps; }) == std::array<int, 3>{118, 65, -118};
    };
    EXPECT_TRUE(comes_true(at_home));
    EXPECT_NEAR(glm::length(state.position - kHome), 0.0, 1e-12);
    device.stop();
    EXPECT_TRUE(comes_true([&] { return usb->look([&] { return board.last_was_zero; }); }));
    device.close();
}

TEST_P(SettableBoard, CalibrationSetsTheBoardsCounters) {
    WoodenFirmware board(GetParam().report_size);
    board.power_on_counters = {17, -4, 3000, 0, 0, 0};
    const auto usb = cable(board);
    plug_in(*usb);
    WoodenDevice device(model(WoodenZeroing::device), {});
    device.open();
    device.start();
    DeviceState state;
    EXPECT_TRUE(comes_true([&] {
        device.read(state);
        return state.freshness == Freshness::fresh;
    }));
    EXPECT_EQ(device.counts().zeroings, 1u);
    EXPECT_EQ(usb->look([&] { return board.counters[2]; }), 6000);
    EXPECT_NEAR(glm::length(state.position - kHome), 0.0, 1e-12);

    usb->look([&] { board.calibration_button = true; });
    EXPECT_TRUE(comes_true([&] { return device.counts().zeroings == 2; })) << "the button";
    EXPECT_FALSE(usb->look([&] { return board.calibration_button; }));
}

TEST_P(Hidraw, UnpluggedItIsStaleAndPluggedInAgainFresh) {
    WoodenFirmware board(GetParam().report_size);
    const auto usb = cable(board);
    plug_in(*usb);
    WoodenDevice::Settings settings;
    settings.reconnect_s = 0.1;
    WoodenDevice device(model(WoodenZeroing::host), settings);
    device.open();
    device.start();
    DeviceState state;
    const auto fresh = [&] {
        device.write({0.1, 0.0, 0.0});
        device.read(state);
        return state.freshness == Freshness::fresh;
    };
    for (std::uint32_t time = 1; time <= 3; ++time) {
        EXPECT_TRUE(comes_true(fresh));
        const std::uint32_t trial = state.trial;
        usb->pull_out();
        EXPECT_TRUE(comes_true([&] { return !fresh(); }));
        EXPECT_TRUE(comes_true([&] { return device.counts().losses == time; }));
        usb->plug_in();
        EXPECT_TRUE(comes_true(fresh));
        // Counted once it is prepared: its first state may be read before that.
        EXPECT_TRUE(comes_true([&] { return device.counts().connections == time + 1; }));
        EXPECT_NE(state.trial, trial) << "the proxy starts at the probe";
    }
}

TEST_P(Hidraw, MotorsAreOffAfterAStallOfTheServo) {
    WoodenFirmware board(GetParam().report_size);
    const auto usb = cable(board);
    plug_in(*usb);
    WoodenDevice device(model(WoodenZeroing::host), {});
    device.open();
    device.start();
    const auto driven = [&] { return usb->look([&] { return board.milliamps[0] != 0; }); };
    bool is_before_the_boards_own = false; // which a machine that stands still trips
    for (int i = 0; i < 3 && !is_before_the_boards_own; ++i) {
        const int trips = usb->look([&] { return board.watchdog_trips; });
        EXPECT_TRUE(comes_true([&] {
            device.write({0.0, 1.0, 1.0});
            return driven();
        }));
        // The servo says nothing any more.
        EXPECT_TRUE(comes_true([&] { return !driven(); }));
        is_before_the_boards_own = usb->look([&] { return board.watchdog_trips; }) == trips;
    }
    EXPECT_TRUE(is_before_the_boards_own);
    EXPECT_TRUE(comes_true([&] {
        device.write({0.0, 1.0, 1.0});
        return driven();
    })) << "it goes on where the servo does";
}

TEST_P(Hidraw, MotorsAreOffAfterAStallOfTheWholeProgram) {
    WoodenFirmware board(GetParam().report_size);
    const auto usb = cable(board);
    plug_in(*usb);
    CountingProtocol node(GetParam().report_size);
    internal::HidPort port(node.find());
    Bytes drive(GetParam().report_size + 1, 0);
    drive[1] = 100; // mA
    ASSERT_TRUE(port.write(drive));
    EXPECT_TRUE(comes_true([&] { return usb->look([&] { return board.motors_on; }); }));
    // Not a word more.
    EXPECT_TRUE(comes_true([&] { return usb->look([&] { return !board.motors_on; }); }));
    EXPECT_EQ(usb->look([&] { return board.watchdog_trips; }), 1);
}

TEST_P(FreeRunningBoard, AQueueThatHadFilledUpIsThrownAway) {
    CountingFirmware firmware(GetParam().report_size);
    const auto usb = cable(firmware);
    plug_in(*usb);
    CountingProtocol protocol(GetParam().report_size);
    internal::HidStream stream(protocol, {});
    stream.open();
    stream.start();
    EXPECT_TRUE(comes_true([&] { return protocol.reports > 100; }));
    protocol.stall_ms = 300; // the kernel's queue holds 63
    EXPECT_TRUE(comes_true([&] { return stream.counts().overruns == 1; }));
    const int then = protocol.reports;
    EXPECT_TRUE(comes_true([&] { return protocol.reports > then + 100; }));
    EXPECT_EQ(protocol.gaps, 1) << "what the kernel had no room for: once";
    stream.stop();
}

TEST(HidrawAccess, AUserWithoutPermissionIsToldOfTheRules) {
    WoodenFirmware board(14);
    UhidCable cable(board, 0x1234, 0x0006);
    connect(cable, AttachedKind::wooden_haptics);
    std::thread([] {
        // The call itself, not the C library's, changes this thread alone.
        constexpr int nobody = 65534;
        ASSERT_EQ(::syscall(SYS_setresuid, nobody, nobody, nobody), 0);
        const std::vector<AttachedDevice> devices = attached_devices();
        ASSERT_EQ(devices.size(), 1u);
        ASSERT_FALSE(devices[0].usable());
        const DeviceFinding& finding = devices[0].findings.front();
        EXPECT_EQ(finding.what, "this user may not read and write " + devices[0].path +
                                    " (0:0, mode 0600)"); // there are no names in here
        EXPECT_NE(finding.remedy.find("palpate devices --udev-rules"), std::string::npos);
        EXPECT_THROW(internal::HidPort port(devices[0].path), std::runtime_error);
    }).join();
}

// What has feature reports, and numbered ones.

TEST(HidrawSpaceMouse, MovesTheProbeAndIsFreshAtRestAndStaleUnplugged) {
    for (const auto kind : {SpaceMouseFirmware::Kind::wired, SpaceMouseFirmware::Kind::wireless}) {
        SpaceMouseFirmware mouse(kind);
        UhidCable cable(mouse, 0x256F, 0xC635);
        connect(cable, AttachedKind::space_mouse);
        SpaceMouseSettings settings;
        settings.reconnect_s = 0.1;
        SpaceMouseDevice device(settings);
        device.open();
        device.start();
        DeviceState state;
        const auto read = [&] { return device.read(state); };
        EXPECT_TRUE(comes_true([&] { return cable.look([&] { return mouse.lamp; }); }));
        cable.look([&] { mouse.axes = {350, 0, 0, 0, 0, 0}; });
        EXPECT_TRUE(comes_true([&] { return read() && state.position.y > 0.01; }));
        cable.look([&] { mouse.axes = {}; });
        EXPECT_TRUE(comes_true([&] { return read() && state.velocity == Vec3(0.0); }));
        std::this_thread::sleep_for(300ms);
        EXPECT_TRUE(read() && state.freshness == Freshness::fresh);
        cable.pull_out();
        EXPECT_TRUE(comes_true([&] { return read() && state.freshness == Freshness::stale; }));
        cable.plug_in();
        EXPECT_TRUE(comes_true([&] { return read() && state.freshness == Freshness::fresh; }));
    }
}

TEST(HidrawForceFeedback, EffectsAreLoadedByFeatureReportsAndForcesArrive) {
    for (const PidLayout& layout : {kAdapterLayout, kBoardLayout}) {
        PidFirmware stick(layout);
        UhidCable cable(stick, 0x1209, 0xFFB0);
        connect(cable, AttachedKind::force_feedback);
        PidDevice device;
        device.open();
        EXPECT_EQ(cable.look([&] { return stick.effects.size(); }), 2u);
        device.start();
        DeviceState state;
        EXPECT_TRUE(comes_true([&] {
            device.write({1.0, -1.0, 0.0});
            device.read(state);
            const auto force = cable.look([&] { return stick.force(); });
            return state.freshness == Freshness::fresh && std::abs(force[0] + 0.5) < 0.01 &&
                   std::abs(force[1] - 0.5) < 0.01;
        }));
        device.stop();
        EXPECT_TRUE(comes_true([&] { return !cable.look([&] { return stick.actuators; }); }));
        EXPECT_EQ(cable.look([&] { return stick.unknown_reports; }), 0);
    }
}

TEST(HidrawForceFeedback, AFullStickIsSaid) {
    PidLayout crowded = kBoardLayout;
    crowded.effects = 1;
    PidFirmware stick(crowded);
    UhidCable cable(stick, 0x1209, 0xFFB0);
    connect(cable, AttachedKind::force_feedback);
    PidDevice device;
    EXPECT_THROW(device.open(), std::runtime_error);
    EXPECT_TRUE(comes_true([&] { return cable.look([&] { return stick.effects.empty(); }); }));
}

constexpr Wiring kUhid8{"uhid_8_bytes", 8, 0x1234, 0x0006, false};
constexpr Wiring kUhid14{"uhid_14_bytes", 14, 0x1234, 0x0006, false};
constexpr Wiring kUsb64{"usb_64_bytes", 64, 0x16C0, 0x0486, true};
constexpr auto kName = [](const testing::TestParamInfo<Wiring>& with) {
    return std::string(with.param.name);
};
INSTANTIATE_TEST_SUITE_P(, Hidraw, testing::Values(kUhid8, kUhid14, kUsb64), kName);
INSTANTIATE_TEST_SUITE_P(, SettableBoard, testing::Values(kUhid14, kUsb64), kName);
INSTANTIATE_TEST_SUITE_P(, FreeRunningBoard, testing::Values(kUhid8), kName);

} // namespace
