// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/devices/device_list.h>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace {

using namespace palpate;

AttachedDevice mouse(const std::string& path) {
    return {path, 0x256F, 0xC635, "3Dconnexion SpaceMouse Compact", AttachedKind::space_mouse, {}};
}

AttachedDevice denied_board() {
    return {"/dev/hidraw5",
            0x1234,
            0x0006,
            "WoodenHaptics board (mbed)",
            AttachedKind::wooden_haptics,
            {{DeviceFinding::Weight::obstacle, "no permission", "install the rules"},
             {DeviceFinding::Weight::note, "it is blue", ""}}};
}

const std::string kHow = "feel with a device: palpate trace SCENE --pace realtime --device "
                         "ADDRESS, the last word of its line, or what its remedy leads to\n";

AttachedDevice keyboard() {
    return {"/dev/hidraw0",
            0x046D,
            0xC31C,
            "Logitech Keyboard",
            AttachedKind::other,
            {{DeviceFinding::Weight::note, "it is a keyboard or a mouse", ""}}};
}

TEST(DeviceList, NothingAttachedSaysSoAndWhatServesAsWell) {
    for (const auto detail : {DeviceListDetail::brief, DeviceListDetail::why}) {
        const std::string text = device_list_text({}, detail);
        EXPECT_TRUE(text.starts_with("no haptic device is attached; a path, an orbit")) << text;
        EXPECT_EQ(text.back(), '\n');
    }
    EXPECT_EQ(nlohmann::json::parse(device_list_json({})),
              nlohmann::json::parse(R"({"devices": [], "plugins": []})"));
}

TEST(DeviceList, BriefNamesWhatToPutIntoTheSceneAndPointsToWhy) {
    EXPECT_EQ(device_list_text({keyboard(), mouse("/dev/hidraw4"), denied_board()},
                               DeviceListDetail::brief),
              "/dev/hidraw4  256f:c635  3Dconnexion SpaceMouse Compact: moves the probe by its "
              "deflection, no force  hid:spacemouse\n"
              "/dev/hidraw5  1234:0006  WoodenHaptics board (mbed): three-dimensional force  NOT "
              "USABLE\n"
              "`palpate devices --why` says why something is not usable, and what helps\n"
              "and 1 other HID device (`--why` lists it)\n");
}

TEST(DeviceList, WhyTellsEveryFindingAndRemedyAndTheOthers) {
    EXPECT_EQ(device_list_text({keyboard(), denied_board()}, DeviceListDetail::why),
              "/dev/hidraw0  046d:c31c  Logitech Keyboard: not a haptic device  -\n"
              "    note: it is a keyboard or a mouse\n"
              "/dev/hidraw5  1234:0006  WoodenHaptics board (mbed): three-dimensional force  NOT "
              "USABLE\n"
              "    in the way: no permission\n"
              "    remedy: install the rules\n"
              "    note: it is blue\n" +
                  kHow);
    EXPECT_EQ(device_list_text({keyboard()}, DeviceListDetail::why).find("--pace"),
              std::string::npos)
        << "nobody holds a keyboard to feel something";
}

// The name of a device that set the title of the terminal that listed it.
TEST(DeviceList, WhatADeviceSaysOfItselfCommandsNoTerminal) {
    AttachedDevice board = denied_board();
    board.name = "evil\x1b]0;title\a\nboard";
    board.findings[0].what = "no\x1b[31m permission";
    const ListedPlugin plugin{"/tmp/a\x1b.so", "udp\r 1.0", ""};
    const ListedPlugin broken{"/tmp/b.so", "", "/tmp/b\x1b.so: is no library; name another one"};
    for (const auto detail : {DeviceListDetail::brief, DeviceListDetail::why}) {
        const std::string text = device_list_text({board}, detail, {plugin, broken});
        EXPECT_NE(text.find("evil?]0;title??board"), std::string::npos) << text;
        for (const char letter : text)
            EXPECT_TRUE(letter == '\n' || static_cast<unsigned char>(letter) >= ' ') << text;
    }
}

AttachedDevice touch() {
    AttachedDevice device{"usb 1-4",
                          0x2988,
                          0x0302,
                          "3D Systems Touch",
                          AttachedKind::foreign,
                          {{DeviceFinding::Weight::obstacle, "no driver", "a plug-in (page)"},
                           {DeviceFinding::Weight::note, "with a fake", ""}}};
    device.way = {"a plug-in", "page", "with a fake"};
    return device;
}

TEST(DeviceList, ADeviceOfAnotherMakerIsListedWithItsWay) {
    EXPECT_EQ(device_list_text({touch()}, DeviceListDetail::why),
              "usb 1-4  2988:0302  3D Systems Touch: a haptic device of another maker's protocol  "
              "by a plug-in\n"
              "    in the way: no driver\n"
              "    remedy: a plug-in (page)\n"
              "    note: with a fake\n" +
                  kHow);
    EXPECT_EQ(device_list_text({touch()}, DeviceListDetail::brief).find("no haptic device"),
              std::string::npos);
    const auto json = nlohmann::json::parse(device_list_json({touch(), denied_board()}));
    EXPECT_EQ(json["devices"][0]["kind"], "foreign");
    EXPECT_EQ(json["devices"][0]["way"],
              nlohmann::json({{"by", "a plug-in"}, {"page", "page"}, {"tested", "with a fake"}}));
    EXPECT_TRUE(json["devices"][1]["way"].is_null());
}

TEST(DeviceList, ThatNothingIsAttachedIsSaidOnlyWhereEverythingWasSeen) {
    const AttachedDevice unseen{"/sys/bus/usb/devices",
                                0,
                                0,
                                "the list of what is on the USB",
                                AttachedKind::unseen,
                                {{DeviceFinding::Weight::obstacle, "cannot be read", "mount it"}}};
    EXPECT_EQ(device_list_text({unseen, keyboard()}, DeviceListDetail::why),
              "/sys/bus/usb/devices: the list of what is on the USB cannot be looked at\n"
              "    in the way: cannot be read\n"
              "    remedy: mount it\n"
              "/dev/hidraw0  046d:c31c  Logitech Keyboard: not a haptic device  -\n"
              "    note: it is a keyboard or a mouse\n"
              "no haptic device was found; a path, an orbit, a tour, a recording or the simulated "
              "hand serves as well: --device path:FILE, orbit, tour, recording:FILE, hand\n");
    EXPECT_EQ(nlohmann::json::parse(device_list_json({unseen}))["devices"][0]["kind"], "unseen");
}

TEST(DeviceList, TwoOfAKindAreToldApartByTheirNodes) {
    const auto json = nlohmann::json::parse(
        device_list_json({mouse("/dev/hidraw4"), mouse("/dev/hidraw6"), denied_board()}));
    EXPECT_EQ(json["devices"][0]["address"], "hid:/dev/hidraw4");
    EXPECT_EQ(json["devices"][1]["address"], "hid:/dev/hidraw6");
    EXPECT_TRUE(json["devices"][2]["address"].is_null());
}

TEST(DeviceList, OfABoardTheOwnerSaysTheModel) {
    AttachedDevice board = denied_board();
    board.findings.clear();
    const auto json = nlohmann::json::parse(device_list_json({board}));
    EXPECT_EQ(json["devices"][0]["address"], "hid:wooden:MODEL");
}

TEST(DeviceList, JsonHasIdsAsTheyAreWrittenAndEveryFinding) {
    const auto json = nlohmann::json::parse(device_list_json({denied_board()}))["devices"][0];
    EXPECT_EQ(json["path"], "/dev/hidraw5");
    EXPECT_EQ(json["vendor"], "1234");
    EXPECT_EQ(json["product"], "0006");
    EXPECT_EQ(json["kind"], "wooden_haptics");
    EXPECT_EQ(json["usable"], false);
    EXPECT_EQ(json["findings"][0]["weight"], "obstacle");
    EXPECT_EQ(json["findings"][0]["remedy"], "install the rules");
    EXPECT_EQ(json["findings"][1]["weight"], "note");
}

} // namespace
