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

constexpr std::array kForeign{
    ForeignProduct{{0x16C0, 0x0483, "Teensy board with a serial port"},
                   "it talks over a serial port and not over HID, as WoodenHaptics, Vintage and "
                   "Polhem do since 2020, if it is one of these",
                   "put firmware with RawHID on it, if its maker has it: Palpate has no driver for "
                   "the serial protocol"},
    ForeignProduct{{0x0403, 0xCB48, "Novint Falcon"},
                   "it talks to an FTDI chip and needs its firmware at each start, not HID",
                   "Palpate has no driver for it"},
    ForeignProduct{{0x0301, 0x2988, "3D Systems Touch"},
                   "it talks over a serial port in a protocol that its maker keeps",
                   "Palpate has no driver for it"},
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

} // namespace palpate::internal
