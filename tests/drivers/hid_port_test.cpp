// SPDX-License-Identifier: Apache-2.0
// The real libhidapi-hidraw on simulated nodes (hid_node.h).
#include <algorithm>
#include <atomic>
#include <csignal>
#include <filesystem>
#include <numeric>
#include <system_error>

#include <gtest/gtest.h>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <unistd.h>

#include <palpate/drivers/internal/hid_port.h>

#include "tests/drivers/hid_node.h"
#include "tests/support/temporary_folder.h"

namespace palpate::internal {
namespace {

using std::chrono::milliseconds;
using test::Bytes;
using test::HidNode;
using test::WriteFault;

const std::string kPath = test::node_path("port");
constexpr milliseconds kLong{20000}; ///< no machine that runs this needs as much

/// Sends what it is told to, and keeps what it is sent.
class ScriptedFirmware final : public test::HidFirmware {
public:
    std::vector<Bytes> to_send;
    std::vector<Bytes> received;
    Bytes feature{0x05, 1, 2, 3};

    Bytes descriptor() const override { return {0x06, 0xAB, 0xFF, 0x0A, 0x00, 0x02, 0xC0}; }
    void power_on(double) override {}
    void receive(std::span<const std::uint8_t> report, double) override {
        received.emplace_back(report.begin(), report.end());
    }
    std::optional<Bytes> send(double) override {
        if (to_send.empty()) return std::nullopt;
        const Bytes report = to_send.front();
        to_send.erase(to_send.begin());
        return report;
    }
    bool set_feature(std::span<const std::uint8_t> report) override {
        if (report[0] != feature[0]) return false;
        feature.assign(report.begin(), report.end());
        return true;
    }
    std::optional<Bytes> get_feature(std::uint8_t number) override {
        if (number != feature[0]) return std::nullopt;
        return feature;
    }
};

/// A report that says which one it is.
Bytes numbered_report(int number, std::size_t size = 14) {
    Bytes bytes(size);
    std::iota(bytes.begin(), bytes.end(), static_cast<std::uint8_t>(number));
    return bytes;
}

std::optional<Bytes> next_report(HidPort& port, milliseconds wait = kLong) {
    Bytes buffer(66);
    std::size_t size = 0;
    if (port.read(buffer, size, wait) != HidRead::report) return std::nullopt;
    buffer.resize(size);
    return buffer;
}

HidRead read_once(HidPort& port, milliseconds wait) {
    Bytes buffer(66);
    std::size_t size = 0;
    return port.read(buffer, size, wait);
}

template <typename F>
std::string message_of(F f) {
    try {
        f();
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "";
}

TEST(HidPort, ReportsPassBothWaysWholeAndInOrder) {
    ScriptedFirmware firmware;
    HidNode node(kPath, firmware);
    HidPort port(kPath);
    node.at_rest([&] {
        for (int i = 0; i < 20; ++i)
            firmware.to_send.push_back(numbered_report(i));
    });
    for (int i = 0; i < 20; ++i)
        EXPECT_EQ(next_report(port), numbered_report(i));
    EXPECT_EQ(read_once(port, milliseconds(0)), HidRead::nothing);

    for (int i = 0; i < 20; ++i) {
        Bytes report = numbered_report(i, 14);
        report.insert(report.begin(), 0);
        EXPECT_TRUE(port.write(report));
    }
    ASSERT_TRUE(node.wait_until([&] { return firmware.received.size() == 20; }));
    for (int i = 0; i < 20; ++i)
        EXPECT_EQ(firmware.received[static_cast<std::size_t>(i)], numbered_report(i));
}

TEST(HidPort, DescriptorIsTheDevices) {
    ScriptedFirmware firmware;
    HidNode node(kPath, firmware);
    EXPECT_EQ(HidPort(kPath).report_descriptor(), firmware.descriptor());
    EXPECT_TRUE(hid_report_descriptor("/dev/hidrawSIMabsent").empty());
}

TEST(HidPort, FeatureReportsGoThereAndBack) {
    ScriptedFirmware firmware;
    HidNode node(kPath, firmware);
    HidPort port(kPath);
    const Bytes sent{0x05, 9, 8, 7};
    EXPECT_TRUE(port.send_feature(sent));
    Bytes answer(16, 0);
    answer[0] = 0x05;
    ASSERT_EQ(port.get_feature(answer), 4u);
    answer.resize(4);
    EXPECT_EQ(answer, sent);
    Bytes other(16, 0);
    other[0] = 0x06;
    EXPECT_EQ(port.get_feature(other), std::nullopt);
    EXPECT_FALSE(port.send_feature(Bytes{0x06, 1}));
}

TEST(HidPort, Case8ReportsOfOtherLengthsComeAsTheyAre) {
    ScriptedFirmware firmware;
    HidNode node(kPath, firmware);
    HidPort port(kPath);
    node.at_rest([&] {
        firmware.to_send = {numbered_report(1, 3),
                            {},
                            numbered_report(2, 64),
                            numbered_report(3, 64),
                            numbered_report(4, 14)};
    });
    EXPECT_EQ(next_report(port), numbered_report(1, 3));
    // A report of length 0 is none, whether the wait was over or not.
    EXPECT_EQ(read_once(port, kLong), HidRead::nothing);
    EXPECT_EQ(next_report(port), numbered_report(2, 64));
    // What does not fit into the buffer is lost, and nothing of it is in the next report.
    Bytes small(15);
    std::size_t size = 0;
    ASSERT_EQ(port.read(small, size, kLong), HidRead::report);
    EXPECT_EQ(size, 15u);
    EXPECT_EQ(small, Bytes(numbered_report(3, 15)));
    EXPECT_EQ(next_report(port), numbered_report(4, 14));
}

TEST(HidPort, Case9UnpluggedIsGoneForReadingAndWriting) {
    ScriptedFirmware firmware;
    HidNode node(kPath, firmware);
    HidPort port(kPath);
    std::atomic<bool> waiting{false};
    std::thread cable([&] {
        while (!waiting)
            std::this_thread::yield();
        node.unplug();
    });
    waiting = true;
    EXPECT_EQ(read_once(port, kLong), HidRead::gone);
    cable.join();
    EXPECT_EQ(read_once(port, milliseconds(0)), HidRead::gone);
    EXPECT_FALSE(port.write(Bytes(15, 0)));
    EXPECT_EQ(read_once(port, milliseconds(0)), HidRead::gone);
}

TEST(HidPort, Case9IsOpenedAgainAfterItWasPluggedInAgain) {
    ScriptedFirmware firmware;
    HidNode node(kPath, firmware);
    for (int i = 0; i < 20; ++i) {
        HidPort port(kPath);
        node.at_rest([&] { firmware.to_send = {numbered_report(i)}; });
        EXPECT_EQ(next_report(port), numbered_report(i));
        node.unplug();
        EXPECT_EQ(read_once(port, kLong), HidRead::gone);
        node.plug_in();
    }
}

TEST(HidPort, Case10ReportThatIsNotTakenWholeFails) {
    ScriptedFirmware firmware;
    HidNode node(kPath, firmware);
    HidPort port(kPath);
    EXPECT_TRUE(port.write(Bytes(15, 0)));
    node.set_write_fault(WriteFault::fails);
    EXPECT_FALSE(port.write(Bytes(15, 0)));
    node.set_write_fault(WriteFault::is_cut);
    EXPECT_FALSE(port.write(Bytes(15, 0)));
    node.set_write_fault(WriteFault::none);
    EXPECT_TRUE(port.write(Bytes(15, 0)));
}

TEST(HidPort, Case11SecondPortIsKeptOutUntilTheFirstIsClosed) {
    ScriptedFirmware firmware;
    HidNode node(kPath, firmware);
    {
        const HidPort port(kPath);
        EXPECT_EQ(message_of([] { HidPort second(kPath); }),
                  kPath + ": another program of Palpate uses this device; stop it first");
        const std::string other = test::node_path("other");
        HidNode other_node(other, firmware);
        EXPECT_NO_THROW(HidPort{other});
    }
    EXPECT_NO_THROW(HidPort{kPath});
}

const std::filesystem::path kLockFolders[] = {"/run/lock", "/tmp"};

TEST(HidPort, Case11UnderAnotherNameItIsTheSameDevice) {
    // What leads to a simulated node leads nowhere, so a folder stands for one: no other run has
    // its lock, and hidapi refuses it (of /dev/null it crashes).
    const test::TemporaryFolder made;
    const std::string node = std::filesystem::canonical(made.path()).string();
    const std::string other = node + "/../" + made.path().filename().string();
    std::string name = "palpate" + node + ".lock";
    std::replace(name.begin(), name.end(), '/', '-');
    std::filesystem::path lock;
    int held = -1;
    for (const std::filesystem::path& folder : kLockFolders) {
        lock = folder / name;
        held = ::open(lock.c_str(), O_RDONLY | O_CREAT | O_CLOEXEC, 0644);
        if (held >= 0) break;
    }
    ASSERT_GE(held, 0);
    ASSERT_EQ(::flock(held, LOCK_EX | LOCK_NB), 0);
    EXPECT_EQ(message_of([&] { HidPort{other}; }),
              other + ": another program of Palpate uses this device; stop it first");
    std::filesystem::remove(lock);
    ::close(held);
}

std::string lock_name() {
    std::string name = "palpate" + kPath + ".lock";
    std::replace(name.begin(), name.end(), '/', '-');
    return name;
}

/// What is in the way of a second port on the device.
std::vector<std::filesystem::path> locks() {
    std::vector<std::filesystem::path> found;
    for (const std::filesystem::path& folder : kLockFolders)
        if (std::filesystem::exists(std::filesystem::symlink_status(folder / lock_name())))
            found.push_back(folder / lock_name());
    return found;
}

TEST(HidPort, ItsLockCanBeReadByEverybodyWhateverTheUmask) {
    ScriptedFirmware firmware;
    HidNode node(kPath, firmware);
    const mode_t before = ::umask(077);
    const HidPort port(kPath);
    ::umask(before);
    ASSERT_EQ(locks().size(), 1u);
    using std::filesystem::perms;
    const perms all = perms::owner_read | perms::group_read | perms::others_read;
    EXPECT_EQ(std::filesystem::status(locks().front()).permissions() & all, all);
}

/// A lock's file that nobody can open, root neither: a link, which is not followed.
class ClosedLock {
public:
    ClosedLock() {
        for (const std::filesystem::path& folder : kLockFolders) {
            std::error_code failed;
            file = folder / lock_name();
            std::filesystem::create_symlink("/dev/null", file, failed);
            if (!failed) return;
        }
        ADD_FAILURE() << "no folder for locks can be written to";
    }
    ~ClosedLock() {
        std::error_code ignored;
        std::filesystem::remove(file, ignored);
    }
    ClosedLock(const ClosedLock&) = delete;
    ClosedLock& operator=(const ClosedLock&) = delete;

    std::filesystem::path file;
};

// Whoever holds it would not see a lock elsewhere.
TEST(HidPort, WhereItsLockCannotBeOpenedThereIsNoSecondOne) {
    ScriptedFirmware firmware;
    HidNode node(kPath, firmware);
    {
        const ClosedLock lock;
        EXPECT_EQ(message_of([] { HidPort{kPath}; }),
                  kPath + ": its lock, " + lock.file.string() +
                      ", cannot be opened (Too many levels of symbolic links); remove it, or let "
                      "this user read it");
        EXPECT_EQ(locks(), std::vector{lock.file});
    }
    EXPECT_NO_THROW(HidPort{kPath});
}

TEST(HidPort, Case16SignalsDoNotEndTheWaitAndAreNoUnplug) {
    ScriptedFirmware firmware;
    HidNode node(kPath, firmware);
    HidPort port(kPath);

    static std::atomic<int> signals{0};
    signals = 0;
    struct sigaction action {
    }, before{};
    action.sa_handler = [](int) { ++signals; };
    sigaction(SIGALRM, &action, &before);
    const itimerval every_2_ms{{0, 2000}, {0, 2000}};
    setitimer(ITIMER_REAL, &every_2_ms, nullptr);

    // The signals come to this thread, the first of the process, as long as it takes them.
    const auto began = std::chrono::steady_clock::now();
    EXPECT_EQ(read_once(port, milliseconds(300)), HidRead::nothing);
    const auto waited = std::chrono::steady_clock::now() - began;
    node.at_rest([&] { firmware.to_send = {numbered_report(7)}; });
    EXPECT_EQ(next_report(port), numbered_report(7));

    const itimerval never{};
    setitimer(ITIMER_REAL, &never, nullptr);
    sigaction(SIGALRM, &before, nullptr);
    EXPECT_GT(signals, 3);
    // Not cut short: each retry waits for what is left, rounded down to whole ms.
    EXPECT_GE(waited, milliseconds(299));
}

TEST(HidPort, WhatIsNotThereIsSaidInWords) {
    EXPECT_EQ(message_of([] { HidPort{kPath}; }),
              kPath + ": there is no such device; plug it in, `palpate devices` lists what is "
                      "attached");
}

TEST(HidPort, AttachedDevicesHaveNodesAndCanBeAskedForAgain) {
    for (int i = 0; i < 3; ++i)
        for (const HidDeviceInfo& info : attached_hid_devices())
            EXPECT_FALSE(info.path.empty());
}

} // namespace
} // namespace palpate::internal
