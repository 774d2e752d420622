// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdio>

#include <palpate/drivers/internal/known_devices.h>

namespace palpate::internal {
namespace {

constexpr std::array kWooden{
    KnownProduct{0x1234, 0x0006, "WoodenHaptics board (mbed)"},
    KnownProduct{0x16C0, 0x0486, "WoodenHaptics board (Teensy RawHID)"},
};

constexpr std::array kSpaceMice{
    KnownProduct{kLogitech, 0xC603, "SpaceMouse Plus XT"},
    KnownProduct{kLogitech, 0xC605, "CADMan"},
    KnownProduct{kLogitech, 0xC606, "SpaceMouse Classic"},
    KnownProduct{kLogitech, 0xC621, "Spaceball 5000"},
    KnownProduct{kLogitech, 0xC623, "SpaceTraveler"},
    KnownProduct{kLogitech, 0xC625, "SpacePilot"},
    KnownProduct{kLogitech, 0xC626, "SpaceNavigator"},
    KnownProduct{kLogitech, 0xC627, "SpaceExplorer"},
    KnownProduct{kLogitech, 0xC628, "SpaceNavigator for Notebooks"},
    KnownProduct{kLogitech, 0xC629, "SpacePilot Pro"},
    KnownProduct{kLogitech, 0xC62B, "SpaceMouse Pro"},
    KnownProduct{kLogitech, 0xC640, "NuLOOQ"},
    KnownProduct{k3Dconnexion, 0xC62E, "SpaceMouse Wireless (cable)"},
    KnownProduct{k3Dconnexion, 0xC62F, "SpaceMouse Wireless"},
    KnownProduct{k3Dconnexion, 0xC631, "SpaceMouse Pro Wireless (cable)"},
    KnownProduct{k3Dconnexion, 0xC632, "SpaceMouse Pro Wireless"},
    KnownProduct{k3Dconnexion, 0xC633, "SpaceMouse Enterprise"},
    KnownProduct{k3Dconnexion, 0xC635, "SpaceMouse Compact"},
    KnownProduct{k3Dconnexion, 0xC636, "SpaceMouse Module"},
    KnownProduct{k3Dconnexion, 0xC638, "SpaceMouse Pro Wireless (Bluetooth)"},
    KnownProduct{k3Dconnexion, 0xC63A, "SpaceMouse Wireless (Bluetooth)"},
    KnownProduct{k3Dconnexion, 0xC641, "SpaceMouse"},
    KnownProduct{k3Dconnexion, 0xC652, "Universal Receiver"},
};

constexpr std::array kCapless{
    KnownProduct{k3Dconnexion, 0xC62C, "device without a cap"},
    KnownProduct{k3Dconnexion, 0xC650, "CadMouse"},
    KnownProduct{k3Dconnexion, 0xC651, "CadMouse"},
    KnownProduct{k3Dconnexion, 0xC654, "CadMouse"},
    KnownProduct{k3Dconnexion, 0xC655, "CadMouse"},
    KnownProduct{k3Dconnexion, 0xC656, "CadMouse"},
    KnownProduct{k3Dconnexion, 0xC657, "CadMouse"},
    KnownProduct{k3Dconnexion, 0xC658, "CadMouse"},
    KnownProduct{k3Dconnexion, 0xC664, "keyboard or keypad"},
    KnownProduct{k3Dconnexion, 0xC665, "keyboard or keypad"},
    KnownProduct{k3Dconnexion, 0xC668, "keyboard or keypad"},
};

constexpr std::array kForceFeedback{
    KnownProduct{0x045E, 0x001B, "SideWinder Force Feedback 2"},
    KnownProduct{0x1209, 0xFFB0, "OpenFFBoard"},
};

constexpr const char* kPluginPage = "docs/device_plugins.md";
constexpr const char* kWithAFake =
    "the plug-in was run with a fake of the library, and not with this device";
constexpr const char* kOpenHaptics =
    "install the device's driver and OpenHaptics of 3D Systems, compile "
    "examples/device_plugins/open_haptics.c, and give --device plugin:./open_haptics.so";
constexpr std::uint16_t kAny = 0;

constexpr ForeignProduct touch(std::uint16_t vendor, std::uint16_t product) {
    return {{vendor, product, "3D Systems Touch"},
            nullptr,
            "touch",
            "its protocol is its maker's, and not public",
            kOpenHaptics,
            "a plug-in",
            kPluginPage,
            kWithAFake};
}

// Where the ids are from, as public repositories have them:
// - 0301:2988: `lsusb` in the README of several ROS packages for the Geomagic Touch, with cdc_acm.
// - 2988:0302: github.com/bharatm11/Geomagic_Touch_ROS_Drivers/issues/2, the Touch with a serial
//   port. 2988:0304: the Touch of 2023, a HID device (dev=HID); issues/17 there: it has no
//   /dev/ttyACM. So vendor 2988 is 3D Systems here, whichever product.
// - 1451: Force Dimension in the udev rules of CHAI3D and of ROS packages; products 0301, 0402,
//   0403 and 040c are seen there, under several models' names. So the device's own name tells.
// - 0403:CB48: the Falcon in the same rules of CHAI3D, and in libnifalcon.
// - 16C0:0483: PJRC's "USB Serial" of every Teensy; forsslund/hfabapi looks for a Teensy's port.
// - Haply has published no ids that we found: it is known by its maker's name alone.
constexpr std::array kForeign{
    touch(0x0301, 0x2988),
    touch(0x2988, kAny),
    ForeignProduct{{0x1451, kAny, "Force Dimension omega, delta, sigma or lambda"},
                   nullptr,
                   "omega delta sigma lambda",
                   "its protocol is its maker's, and not public",
                   "install the SDK of Force Dimension, compile "
                   "examples/device_plugins/force_dimension.cpp, and give "
                   "--device plugin:./force_dimension.so",
                   "a plug-in",
                   kPluginPage,
                   kWithAFake},
    ForeignProduct{{0x0403, 0xCB48, "Novint Falcon"},
                   nullptr,
                   "falcon",
                   "it talks through an FTDI chip, and needs its firmware at each start",
                   "install libnifalcon, compile examples/device_plugins/falcon.cpp, and give "
                   "--device plugin:./falcon.so",
                   "a plug-in",
                   kPluginPage,
                   kWithAFake},
    ForeignProduct{{kAny, kAny, "Haply Inverse3"},
                   "Haply",
                   "inverse3",
                   "it talks to its maker's Inverse Service, and that to Palpate",
                   "install and start the Inverse Service of Haply, and give --device inverse3",
                   "a service",
                   "docs/devices.md",
                   "with a simulated service, and not with this device; its USB ids are not "
                   "published, so its maker's name is what it is known by"},
    ForeignProduct{{0x16C0, 0x0483, "Teensy board with a serial port"},
                   nullptr,
                   "teensy",
                   "it talks over a serial port and not over HID, as WoodenHaptics, Vintage and "
                   "Polhem do since 2020, if it is one of these",
                   "let a program of yours read and write its lines of text, and pass them on with "
                   "examples/device_plugin_udp: --device plugin:./udp_device.so; or put firmware "
                   "with RawHID on it, if its maker has it: then it is hid:wooden:MODEL",
                   "a plug-in",
                   kPluginPage,
                   "the UDP plug-in was run with a hand in Python, and not with this board"},
};

} // namespace

std::span<const KnownProduct> wooden_products() { return kWooden; }
std::span<const KnownProduct> space_mouse_products() { return kSpaceMice; }
std::span<const KnownProduct> capless_products() { return kCapless; }
std::span<const KnownProduct> force_feedback_products() { return kForceFeedback; }
std::span<const ForeignProduct> foreign_products() { return kForeign; }

const KnownProduct* find_product(std::span<const KnownProduct> among, std::uint16_t vendor,
                                 std::uint16_t product) noexcept {
    const auto found = std::find_if(among.begin(), among.end(), [&](const KnownProduct& one) {
        return one.vendor == vendor && one.product == product;
    });
    return found == among.end() ? nullptr : &*found;
}

const ForeignProduct* find_foreign(std::uint16_t vendor, std::uint16_t product,
                                   std::string_view name) noexcept {
    const auto found =
        std::find_if(kForeign.begin(), kForeign.end(), [&](const ForeignProduct& one) {
            if (one.maker != nullptr) return name.find(one.maker) != std::string_view::npos;
            return one.id.vendor == vendor && (one.id.product == product || one.id.product == kAny);
        });
    return found == kForeign.end() ? nullptr : &*found;
}

bool has_word(std::string_view words, std::string_view word) noexcept {
    while (!words.empty()) {
        const std::size_t end = std::min(words.find(' '), words.size());
        if (words.substr(0, end) == word) return true;
        words.remove_prefix(std::min(end + 1, words.size()));
    }
    return false;
}

bool is_wooden(const HidDeviceInfo& info) noexcept {
    constexpr std::uint16_t vendors_page = 0xFFAB;
    return info.usage_page == vendors_page &&
           find_product(kWooden, info.vendor, info.product) != nullptr;
}

bool is_space_mouse(const HidDeviceInfo& info) noexcept {
    constexpr std::uint16_t generic_desktop = 0x01, multi_axis = 0x08;
    const bool maker = info.vendor == kLogitech || info.vendor == k3Dconnexion;
    return maker && info.usage_page == generic_desktop && info.usage == multi_axis &&
           find_product(kCapless, info.vendor, info.product) == nullptr;
}

std::string udev_rule(std::uint16_t vendor, std::uint16_t product) {
    std::array<char, 160> line{};
    std::snprintf(line.data(), line.size(),
                  "KERNEL==\"hidraw*\", KERNELS==\"*:%04X:%04X.*\", MODE=\"0660\", "
                  "GROUP=\"plugdev\", TAG+=\"uaccess\"",
                  static_cast<unsigned>(vendor), static_cast<unsigned>(product));
    return line.data();
}

std::string usb_udev_rule(std::uint16_t vendor, std::uint16_t product) {
    std::array<char, 160> line{};
    std::snprintf(line.data(), line.size(),
                  "SUBSYSTEM==\"usb\", ATTR{idVendor}==\"%04x\", ATTR{idProduct}==\"%04x\", "
                  "MODE=\"0660\", GROUP=\"plugdev\", TAG+=\"uaccess\"",
                  static_cast<unsigned>(vendor), static_cast<unsigned>(product));
    return line.data();
}

} // namespace palpate::internal
