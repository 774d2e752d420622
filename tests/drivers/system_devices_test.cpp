// SPDX-License-Identifier: Apache-2.0
// What the system tells of devices: sysfs and proc of a folder of our own.
#include <palpate/drivers/internal/system_devices.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include <sys/syscall.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include <palpate/drivers/internal/device_judgement.h>
#include <palpate/drivers/internal/hid_descriptor.h>

#include "tests/drivers/device_findings.h"
#include "tests/support/temporary_folder.h"

using namespace palpate;
using namespace palpate::internal;
using palpate::test::finding;
using palpate::test::TemporaryFolder;

namespace {

using Weight = DeviceFinding::Weight;

void put(const std::filesystem::path& file, const std::string& text) {
    std::filesystem::create_directories(file.parent_path());
    test::make_file(file, text);
}

TEST(SystemDevices, ANodeIsListedOnceWithWhatSysfsAndProcTellOfIt) {
    const TemporaryFolder folder;
    const SystemFolders system{folder / "sys", folder / "proc", folder / "rules"};
    const std::string node = (folder / "hidraw4").string();
    put(node, "");
    const auto device = system.sys / "class" / "hidraw" / "hidraw4" / "device";
    const std::string descriptor("\x06\xAB\xFF\x00\x0A", 5);
    put(device / "report_descriptor", descriptor);
    put(device / "input" / "input7" / "capabilities" / "ff", "107030000 0\n");
    put(system.rules / "70-palpate.rules", "");
    put(system.proc / "812" / "comm", "spacenavd\n");
    std::filesystem::create_directories(system.proc / "812" / "fd");
    std::filesystem::create_symlink(node, system.proc / "812" / "fd" / "3");
    put(system.proc / "813" / "comm", "innocent\n");
    std::filesystem::create_directories(system.proc / "813" / "fd");

    HidDeviceInfo first, second;
    first.path = second.path = node;
    second.usage = 8;
    const std::vector<HidEvidence> found = hid_evidence({first, second}, system);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].collections.size(), 2u);
    EXPECT_EQ(std::string(found[0].descriptor.begin(), found[0].descriptor.end()), descriptor);
    EXPECT_EQ(found[0].access, NodeAccess::granted);
    EXPECT_TRUE(found[0].rules_installed);
    EXPECT_TRUE(found[0].kernel_makes_forces);
    EXPECT_EQ(found[0].holders, std::vector<std::string>{"spacenavd (process 812)"});
}

TEST(SystemDevices, WhatIsNotThereIsSaidToBeMissing) {
    const TemporaryFolder folder;
    HidDeviceInfo info;
    info.path = (folder / "hidraw9").string();
    const std::vector<HidEvidence> found =
        hid_evidence({info}, {folder / "sys", folder / "proc", folder / "rules"});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].access, NodeAccess::missing);
    EXPECT_TRUE(found[0].descriptor.empty());
    EXPECT_FALSE(found[0].rules_installed || found[0].kernel_makes_forces);
}

TEST(SystemDevices, ANodeOfSomebodyElseIsDenied) {
    const TemporaryFolder folder;
    HidDeviceInfo info;
    info.path = (folder / "hidraw9").string();
    put(info.path, "");
    std::filesystem::permissions(folder.path(), std::filesystem::perms(0755));
    std::filesystem::permissions(info.path, std::filesystem::perms::none);
    std::vector<HidEvidence> found;
    std::thread([&] {
        // Root may open everything. The call itself, not the C library's, changes this thread
        // alone.
        constexpr int nobody = 65534;
        if (::geteuid() == 0) ::syscall(SYS_setresuid, nobody, nobody, nobody);
        found = hid_evidence({info}, {folder / "sys", folder / "proc", folder / "rules"});
    }).join();
    EXPECT_EQ(found.front().access, NodeAccess::denied);
    EXPECT_NE(found.front().owner.find("mode 0000"), std::string::npos);
}

TEST(SystemDevices, UsbDevicesAreListedAndTheirInterfacesAreNot) {
    const TemporaryFolder folder;
    const SystemFolders system{folder / "sys", folder / "proc", folder / "rules"};
    const auto bus = system.sys / "bus" / "usb" / "devices";
    put(bus / "1-4" / "idVendor", "16c0\n");
    put(bus / "1-4" / "idProduct", "0483\n");
    put(bus / "1-4" / "manufacturer", "Teensyduino\n");
    put(bus / "1-4" / "product", "USB Serial\n");
    put(bus / "1-4:1.0" / "bInterfaceClass", "02\n");
    const std::vector<UsbEvidence> found = usb_evidence(system);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].place, "usb 1-4");
    EXPECT_EQ(found[0].vendor, 0x16C0);
    EXPECT_EQ(found[0].product, 0x0483);
    EXPECT_EQ(found[0].name, "Teensyduino USB Serial");
    EXPECT_FALSE(found[0].is_port || found[0].is_hid);
    EXPECT_TRUE(usb_evidence(system_folders(folder / "nowhere")).empty());
}

TEST(SystemDevices, OfAUsbDeviceItIsSeenWhatALibraryOpens) {
    const TemporaryFolder folder;
    const SystemFolders system = system_folders(folder.path());
    const auto bus = system.sys / "bus" / "usb" / "devices";
    for (const char* place : {"1-4", "2-1.3"}) {
        put(bus / place / "idVendor", "2988\n");
        put(bus / place / "idProduct", "0302\n");
        put(bus / place / "busnum", "2\n");
        put(bus / place / "devnum", "14\n");
    }
    put(bus / "1-4:1.0" / "bInterfaceClass", "02\n");
    put(bus / "1-4:1.0" / "tty" / "ttyACM0" / "dev", "166:0\n");
    put(system.dev / "ttyACM0", "");
    put(bus / "2-1.3:1.0" / "bInterfaceClass", "03\n");
    const std::vector<UsbEvidence> found = usb_evidence(system);
    ASSERT_EQ(found.size(), 2u);
    EXPECT_EQ(found[0].node, (system.dev / "ttyACM0").string());
    EXPECT_TRUE(found[0].is_port);
    EXPECT_EQ(found[0].access, NodeAccess::granted);
    EXPECT_EQ(found[1].node, (system.dev / "bus/usb/002/014").string());
    EXPECT_TRUE(found[1].is_hid && !found[1].is_port);
    EXPECT_EQ(found[1].access, NodeAccess::missing);
}

TEST(SystemDevices, AListThatCannotBeReadIsSaid) {
    const TemporaryFolder folder;
    const SystemFolders system = system_folders(folder.path());
    const auto without_sys = unseen_usb(system);
    ASSERT_TRUE(without_sys);
    EXPECT_EQ(without_sys->kind, AttachedKind::unseen);
    EXPECT_FALSE(without_sys->usable());
    EXPECT_TRUE(finding(*without_sys, Weight::obstacle, "bus/usb/devices cannot be read"));
    std::filesystem::create_directories(system.sys / "bus");
    const auto without_usb = unseen_usb(system);
    ASSERT_TRUE(without_usb);
    EXPECT_TRUE(finding(*without_usb, Weight::obstacle, "this system has no USB"));
    std::filesystem::create_directories(system.sys / "bus/usb/devices");
    EXPECT_FALSE(unseen_usb(system));
}

TEST(SystemDevices, AFileThatWeHaveOpenHasUsAsItsHolder) {
    const TemporaryFolder folder;
    const std::string file = (folder / "held").string();
    EXPECT_TRUE(holders_of(file).empty());
    std::ofstream open(file);
    const std::vector<std::string> holders = holders_of(file);
    ASSERT_EQ(holders.size(), 1u);
    EXPECT_NE(holders[0].find("(process " + std::to_string(::getpid()) + ")"), std::string::npos);
}

} // namespace
