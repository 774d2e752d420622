// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/attached_devices.h>
#include <palpate/drivers/internal/device_judgement.h>
#include <palpate/drivers/internal/hid_descriptor.h>
#include <palpate/drivers/internal/known_devices.h>
#include <palpate/drivers/internal/system_devices.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/drivers/device_findings.h"

#include <tests/support/hid_descriptors.h>
#include <tests/support/temporary_folder.h>

using namespace palpate;
using namespace palpate::internal;
using palpate::test::finding;
using palpate::test::TemporaryFolder;

namespace {

using Weight = DeviceFinding::Weight;

HidEvidence attached(std::uint16_t vendor, std::uint16_t product, HidUsage usage,
                     std::vector<std::uint8_t> descriptor = {}) {
    HidDeviceInfo info;
    info.path = "/dev/hidraw4";
    info.vendor = vendor;
    info.product = product;
    info.usage_page = static_cast<std::uint16_t>(usage >> 16);
    info.usage = static_cast<std::uint16_t>(usage);
    HidEvidence evidence;
    evidence.collections = {info};
    evidence.descriptor = std::move(descriptor);
    return evidence;
}

constexpr HidUsage kBoardUsage = hid_usage(0xFFAB, 0x0200), kMultiAxis = hid_usage(1, 8),
                   kJoystick = hid_usage(1, 4);

/// A board as the WoodenHaptics have, with reports of other lengths.
std::vector<std::uint8_t> board(std::uint32_t in, std::uint32_t out) {
    test::DescriptorWriter w;
    w.page(0xFFAB).begin(0x0200, test::DescriptorWriter::application).range(0, 255);
    w.values(8, in).usage(1).input().values(8, out).usage(2).output().end();
    return w.bytes();
}

TEST(DeviceJudgement, BoardsAreKnownByIdsAndUsageInAllThreeLayouts) {
    for (const std::uint32_t bytes : {8u, 14u, 64u}) {
        const AttachedDevice device =
            judged(attached(0x1234, 0x0006, kBoardUsage, board(bytes, bytes)));
        EXPECT_EQ(device.kind, AttachedKind::wooden_haptics);
        EXPECT_TRUE(device.usable());
        EXPECT_EQ(device.name, "WoodenHaptics board (mbed)");
        EXPECT_EQ(device.path, "/dev/hidraw4");
    }
    EXPECT_TRUE(judged(attached(0x16C0, 0x0486, kBoardUsage)).usable()) << "without a descriptor";
    const AttachedDevice second = judged(attached(0x16C0, 0x0486, hid_usage(0xFFC9, 4)));
    EXPECT_EQ(second.kind, AttachedKind::other) << "a Teensy's serial emulation";
}

TEST(DeviceJudgement, ReportsOfUnknownLengthAreAnObstacleThatTellsTheLengths) {
    const AttachedDevice device = judged(attached(0x1234, 0x0006, kBoardUsage, board(16, 1)));
    EXPECT_FALSE(device.usable());
    EXPECT_TRUE(finding(device, Weight::obstacle, "16 bytes in and 1 byte out; 8, 14 and 64"));
}

TEST(DeviceJudgement, ReportsOfKnownLengthInAnotherCollectionAreNotBlamedForTheirLength) {
    test::DescriptorWriter teensy; // its serial emulation comes first
    teensy.page(0xFFC9).begin(0x04, test::DescriptorWriter::application).end();
    teensy.page(0xFFAB).begin(0x0200, test::DescriptorWriter::application).range(0, 255);
    teensy.values(8, 64).usage(1).input().values(8, 64).usage(2).output().end();
    const AttachedDevice device = judged(attached(0x16C0, 0x0486, kBoardUsage, teensy.bytes()));
    EXPECT_FALSE(device.usable());
    EXPECT_TRUE(
        finding(device, Weight::obstacle,
                "64 bytes in and 64 bytes out; that is known of one collection, FFAB/0200"));
    EXPECT_FALSE(finding(device, Weight::obstacle, "8, 14 and 64 both ways are known"));
}

TEST(DeviceJudgement, EveryCapIsAProbeAndWhatHasNoneIsNot) {
    for (const KnownProduct& product : space_mouse_products()) {
        const AttachedDevice device =
            judged(attached(product.vendor, product.product, kMultiAxis,
                            test::space_mouse_descriptor(product.product % 2 == 0)));
        EXPECT_EQ(device.kind, AttachedKind::space_mouse) << product.name;
        EXPECT_TRUE(device.usable()) << product.name;
        // A receiver's other interfaces: keyboard, mouse.
        EXPECT_EQ(judged(attached(product.vendor, product.product, hid_usage(1, 6))).kind,
                  AttachedKind::other);
    }
    for (const KnownProduct& product : capless_products())
        EXPECT_EQ(judged(attached(product.vendor, product.product, kMultiAxis)).kind,
                  AttachedKind::other)
            << product.name;
    // A newer model by its usage; a mouse of the same maker is none.
    EXPECT_TRUE(finding(judged(attached(k3Dconnexion, 0xC6FF, kMultiAxis)), Weight::note,
                        "a model that is not known"));
    EXPECT_EQ(judged(attached(kLogitech, 0xC077, hid_usage(1, 2))).kind, AttachedKind::other);
    EXPECT_EQ(judged(attached(0x054C, 0x0CE6, kMultiAxis)).kind, AttachedKind::other);
}

TEST(DeviceJudgement, AMotionReportOfUnknownLengthIsAnObstacle) {
    test::DescriptorWriter w;
    w.page(1).begin(8, test::DescriptorWriter::application).id(1).range(-350, 350).values(8, 6);
    w.usages(0x30, 0x35).input().end();
    const std::vector<std::uint8_t> seven_bytes = w.bytes();
    EXPECT_TRUE(judged(attached(k3Dconnexion, 0xC635, kMultiAxis, seven_bytes)).usable());
    test::DescriptorWriter five;
    five.page(1).begin(8, test::DescriptorWriter::application).id(1).range(-350, 350).values(8, 4);
    five.usages(0x30, 0x33).input().end();
    EXPECT_TRUE(finding(judged(attached(k3Dconnexion, 0xC635, kMultiAxis, five.bytes())),
                        Weight::obstacle, "has 5 bytes; 7 and 13 are known"));
}

TEST(DeviceJudgement, SticksWithForcesAreKnownByTheirDescriptor) {
    for (const test::PidLayout& layout : {test::kAdapterLayout, test::kBoardLayout}) {
        HidEvidence stick = attached(0x6666, 0x0001, kJoystick, test::pid_descriptor(layout));
        EXPECT_EQ(judged(stick).kind, AttachedKind::force_feedback);
        EXPECT_TRUE(judged(stick).usable());
        EXPECT_TRUE(judged(stick).findings.empty());
        stick.kernel_makes_forces = true;
        EXPECT_TRUE(judged(stick).usable());
        EXPECT_TRUE(finding(judged(stick), Weight::note, "hid-pidff"));
    }
    const AttachedDevice without = judged(attached(0x1209, 0xFFB0, kJoystick));
    EXPECT_TRUE(finding(without, Weight::obstacle, "report descriptor cannot be read"));
    EXPECT_EQ(without.name, "OpenFFBoard");
    const AttachedDevice plain =
        judged(attached(0x1209, 0xFFB0, kJoystick, test::space_mouse_descriptor(false)));
    EXPECT_TRUE(finding(plain, Weight::obstacle, "has no Create New Effect"));
}

TEST(DeviceJudgement, ADamagedDescriptorIsAnObstacleWithItsByte) {
    std::vector<std::uint8_t> damaged = board(14, 14);
    damaged.resize(9);
    const AttachedDevice device = judged(attached(0x1234, 0x0006, kBoardUsage, damaged));
    const DeviceFinding* found = finding(device, Weight::obstacle, "byte 8");
    ASSERT_TRUE(found) << "of what was cut off, the last item begins there";
    EXPECT_EQ(found->what.find("/dev/"), std::string::npos) << "the path is said once, above";
    EXPECT_NE(found->remedy.find("firmware"), std::string::npos);
}

TEST(DeviceJudgement, WithoutPermissionTheRulesAreNamedOrWhatElseWouldHelp) {
    HidEvidence evidence = attached(k3Dconnexion, 0xC635, kMultiAxis);
    evidence.access = NodeAccess::denied;
    evidence.owner = "root:root, mode 0600";
    const AttachedDevice first = judged(evidence);
    EXPECT_FALSE(first.usable());
    const DeviceFinding* found =
        finding(first, Weight::obstacle, "/dev/hidraw4 (root:root, mode 0600)");
    ASSERT_TRUE(found);
    EXPECT_NE(found->remedy.find("palpate devices --udev-rules | sudo tee"), std::string::npos);
    evidence.rules_installed = true;
    EXPECT_TRUE(finding(judged(evidence), Weight::obstacle, "sudo adduser $USER plugdev"));
    HidEvidence stick =
        attached(0x6666, 0x0001, kJoystick, test::pid_descriptor(test::kBoardLayout));
    stick.access = NodeAccess::denied;
    EXPECT_TRUE(finding(judged(stick), Weight::obstacle, "KERNELS==\"*:6666:0001.*\""))
        << "the rules know nothing of it";
    evidence.access = NodeAccess::missing;
    EXPECT_TRUE(finding(judged(evidence), Weight::obstacle, "--device=/dev/hidraw4"));
}

TEST(DeviceJudgement, HoldersAreObstaclesOnlyWhereTheyWouldSendForces) {
    HidEvidence mouse = attached(k3Dconnexion, 0xC635, kMultiAxis);
    mouse.holders = {"spacenavd (process 812)"};
    EXPECT_TRUE(judged(mouse).usable());
    EXPECT_TRUE(finding(judged(mouse), Weight::note, "spacenavd (process 812) reads it as well"));
    HidEvidence wooden = attached(0x1234, 0x0006, kBoardUsage, board(14, 14));
    wooden.holders = {"haptics (process 7)", "palpate (process 99)"};
    const AttachedDevice device = judged(wooden);
    EXPECT_FALSE(device.usable());
    EXPECT_EQ(device.findings.front().weight, Weight::obstacle) << "obstacles come first";
    EXPECT_TRUE(finding(device, Weight::obstacle, "palpate (process 99) uses it"));
    EXPECT_TRUE(finding(device, Weight::note, "haptics (process 7) has it open"));
}

struct OtherMaker {
    UsbEvidence usb;
    const char* name;   ///< that we give it, where it has none of its own
    const char* called; ///< one of its names
    const char* remedy; ///< a part of it
};

const OtherMaker kOtherMakers[] = {
    {{"usb 1-1", 0x0301, 0x2988, ""}, "3D Systems Touch", "touch", "plugin:./open_haptics.so"},
    {{"usb 1-2", 0x2988, 0x0302, ""}, "3D Systems Touch", "touch", "open_haptics.c"},
    {{"usb 1-3", 0x2988, 0x0304, ""}, "3D Systems Touch", "touch", "docs/device_plugins.md"},
    {{"usb 1-4", 0x1451, 0x0402, "Force Dimension omega.7"},
     "Force Dimension omega.7",
     "omega",
     "force_dimension.cpp"},
    {{"usb 1-5", 0x1451, 0x0403, ""},
     "Force Dimension omega, delta, sigma or lambda",
     "sigma",
     "plugin:./force_dimension.so"},
    {{"usb 1-6", 0x0403, 0xCB48, ""}, "Novint Falcon", "falcon", "plugin:./falcon.so"},
    {{"usb 1-7", 0xABCD, 0x0001, "Haply Robotics Inverse3"},
     "Haply Robotics Inverse3",
     "inverse3",
     "Inverse Service"},
    {{"usb 1-8", 0x16C0, 0x0483, "Teensyduino USB Serial"},
     "Teensyduino USB Serial",
     "teensy",
     "examples/device_plugin_udp"},
};

TEST(DeviceJudgement, DevicesOfOtherMakersAreKnownWithTheWayThatLeadsToThem) {
    for (const OtherMaker& one : kOtherMakers) {
        SCOPED_TRACE(one.usb.place);
        const auto device = judged(one.usb, {});
        ASSERT_TRUE(device);
        EXPECT_EQ(device->kind, AttachedKind::foreign);
        EXPECT_FALSE(device->usable());
        EXPECT_EQ(device->name, one.name);
        EXPECT_TRUE(has_word(device->called, one.called));
        EXPECT_FALSE(device->way.by.empty() || device->way.page.empty());
        EXPECT_NE(device->way.tested.find("not with this"), std::string::npos) << "no more is true";
        EXPECT_TRUE(finding(*device, Weight::obstacle, one.remedy));
        EXPECT_TRUE(finding(*device, Weight::note, device->way.tested));
    }
    EXPECT_FALSE(judged(UsbEvidence{"usb 1-1", 0x1D6B, 0x0002, "hub"}, {}));
    EXPECT_FALSE(judged(UsbEvidence{"usb 1-1", 0x0403, 0x6001, "FTDI FT232R"}, {}))
        << "a serial adapter of the Falcon's chip";
}

TEST(DeviceJudgement, ATouchIsKnownInBothOfItsForms) {
    UsbEvidence serial{"usb 1-2", 0x2988, 0x0302, ""};
    serial.is_port = true;
    serial.node = "/dev/ttyACM0";
    serial.access = NodeAccess::denied;
    serial.owner = "root:dialout, mode 0660";
    const auto port = judged(serial, {});
    ASSERT_TRUE(port);
    EXPECT_TRUE(finding(*port, Weight::obstacle, "attached with the serial port /dev/ttyACM0"));
    EXPECT_TRUE(finding(*port, Weight::note, "/dev/ttyACM0 (root:dialout, mode 0660)"));
    EXPECT_TRUE(finding(*port, Weight::note, "sudo adduser $USER dialout"));

    const HidEvidence node = attached(0x2988, 0x0304, hid_usage(0xFF00, 1));
    const AttachedDevice hid = judged(node);
    EXPECT_EQ(hid.kind, AttachedKind::foreign);
    EXPECT_EQ(hid.path, "/dev/hidraw4");
    EXPECT_TRUE(finding(hid, Weight::obstacle, "attached as a HID device"));
    EXPECT_TRUE(has_word(hid.called, "touch"));
    EXPECT_FALSE(judged(UsbEvidence{"usb 1-2", 0x2988, 0x0304, ""}, {node})) << "it is listed";
}

TEST(DeviceJudgement, WhatALibraryOpensOnTheUsbNeedsARule) {
    UsbEvidence falcon{"usb 2-1", 0x0403, 0xCB48, ""};
    falcon.node = "/dev/bus/usb/002/005";
    falcon.access = NodeAccess::denied;
    const auto device = judged(falcon, {});
    ASSERT_TRUE(device);
    EXPECT_TRUE(finding(*device, Weight::note,
                        "SUBSYSTEM==\"usb\", ATTR{idVendor}==\"0403\", "
                        "ATTR{idProduct}==\"cb48\""));
}

TEST(DeviceJudgement, OnTheUsbWithoutANodeTheKernelsDriverIsMissing) {
    const UsbEvidence usb{"usb 1-2", k3Dconnexion, 0xC635, "3Dconnexion SpaceMouse Compact"};
    const auto without = judged(usb, {});
    ASSERT_TRUE(without);
    EXPECT_EQ(without->kind, AttachedKind::space_mouse);
    EXPECT_FALSE(without->usable());
    EXPECT_EQ(without->path, "usb 1-2");
    EXPECT_TRUE(finding(*without, Weight::obstacle, "sudo modprobe usbhid"));
    EXPECT_FALSE(judged(usb, {attached(k3Dconnexion, 0xC635, kMultiAxis)})) << "it is listed there";
}

TEST(AttachedDevices, ListingThemDoesNotFailWhateverIsAttachedHere) {
    for (const AttachedDevice& device : attached_devices())
        EXPECT_FALSE(device.path.empty());
}

TEST(AttachedDevices, AnAddressIsAKindOrANodeAndAnObstacleIsSaid) {
    HidEvidence denied = attached(k3Dconnexion, 0xC635, kMultiAxis);
    denied.collections[0].path = "/dev/hidraw1";
    denied.access = NodeAccess::denied;
    HidEvidence keyboard = attached(kLogitech, 0xC31C, hid_usage(1, 6));
    keyboard.collections[0].path = "/dev/hidraw0";
    const std::vector<AttachedDevice> devices = {
        judged(keyboard), judged(denied), judged(attached(k3Dconnexion, 0xC635, kMultiAxis))};
    EXPECT_EQ(device_at("spacemouse", devices).path, "/dev/hidraw4") << "the usable one";
    EXPECT_EQ(device_at("/dev/hidraw4", devices).kind, AttachedKind::space_mouse);
    const auto refused = [&](const std::string& address, const std::string& begin,
                             const std::string& part) {
        try {
            device_at(address, devices);
            ADD_FAILURE() << "taken: " << address;
        } catch (const std::runtime_error& error) {
            EXPECT_TRUE(std::string(error.what()).starts_with(begin)) << error.what();
            EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
        }
    };
    refused("/dev/hidraw1", "/dev/hidraw1: this user may not", "udev-rules");
    refused("/dev/hidraw0", "/dev/hidraw0: it is a keyboard", "; `palpate devices` lists");
    refused("/dev/hidraw9", "hid:/dev/hidraw9: none is attached", "; plug it in");
    refused("wooden", "hid:wooden: none is attached", "; plug it in");
    refused("mouse", "hid:mouse: no such kind", "; give wooden, spacemouse");
    refused("", "hid:: no such kind", "; give wooden");
}

TEST(AttachedDevices, ADeviceOfAnotherMakerIsNamedWithItsWay) {
    std::vector<AttachedDevice> devices;
    const auto refusal = [&](const std::string& address) -> std::string {
        try {
            device_at(address, devices);
        } catch (const std::runtime_error& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_EQ(refusal("touch"), "hid:touch: none is attached; plug it in, `palpate devices` lists "
                                "what is");
    devices = {*unseen_usb(system_folders("/nowhere/at/all"))};
    EXPECT_NE(refusal("touch").find("hid:touch: none was found, and /nowhere/at/all/sys/bus/usb/"
                                    "devices cannot be read"),
              std::string::npos)
        << refusal("touch");
    devices.clear();
    for (const OtherMaker& one : kOtherMakers)
        devices.push_back(*judged(one.usb, {}));
    for (const OtherMaker& one : kOtherMakers) {
        const std::string said = refusal(one.called);
        EXPECT_NE(said.find("Palpate does not reach it by USB: "), std::string::npos) << said;
        EXPECT_NE(said.find(one.remedy), std::string::npos) << said;
    }
    EXPECT_TRUE(refusal("omega").starts_with("usb 1-4 is a Force Dimension omega.7 (1451:0402): "))
        << refusal("omega");
}

TEST(AttachedDevices, ALinkToANodeIsTheNode) {
    const TemporaryFolder folder;
    std::ofstream(folder / "hidraw3") << "";
    std::filesystem::create_symlink(folder / "hidraw3", folder / "left");
    const AttachedDevice mouse{(folder / "hidraw3").string(), 0x256F, 0xC635, "SpaceMouse",
                               AttachedKind::space_mouse,     {}};
    EXPECT_EQ(device_at((folder / "left").string(), {mouse}).path, mouse.path);
}

TEST(UdevRules, TheShippedFileIsWhatTheCommandPrints) {
    EXPECT_EQ(test::content_of(PALPATE_UDEV_RULES), udev_rules());
}

TEST(UdevRules, EveryKnownDeviceHasItsRule) {
    const std::string rules = udev_rules();
    EXPECT_NE(rules.find("KERNEL==\"hidraw*\", KERNELS==\"*:1234:0006.*\", MODE=\"0660\", "
                         "GROUP=\"plugdev\", TAG+=\"uaccess\"\n"),
              std::string::npos);
    for (const char* ids : {"16C0:0486", "046D:C626", "256F:C652", "1209:FFB0", "045E:001B"})
        EXPECT_NE(rules.find(ids), std::string::npos) << ids;
    for (const KnownProduct& capless : capless_products()) {
        char id[8];
        std::snprintf(id, sizeof id, ":%04X.", static_cast<unsigned>(capless.product));
        EXPECT_EQ(rules.find(id), std::string::npos) << id;
    }
}

} // namespace
