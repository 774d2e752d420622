// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace palpate {

/// What Palpate makes of something that is attached.
enum class AttachedKind : std::uint8_t {
    wooden_haptics, ///< WoodenHaptics and its kin: three degrees of freedom with force
    space_mouse,    ///< 3Dconnexion: a rate-controlled probe without force
    force_feedback, ///< a stick with constant forces (USB PID): two degrees of freedom
    foreign,        ///< a haptic device that Palpate has no driver for: `way` leads to it
    other,          ///< a keyboard, a mouse: none of our business
    unseen          ///< no device: a list of the system's that cannot be read
};

/// What leads from a device to Palpate where there is no driver for it here.
struct DeviceWay {
    std::string by;     ///< "a plug-in", "a service"; empty: there is a driver, or no way
    std::string page;   ///< the page that tells it: "docs/device_plugins.md"
    std::string tested; ///< what was run of it, and what was not
};

/// Something that is in the way of a device, or good to know about it.
struct DeviceFinding {
    /// How much a finding matters: an obstacle keeps the device from being used.
    enum class Weight : std::uint8_t { note, obstacle };
    Weight weight = Weight::note; ///< note: the device can be used
    std::string what;             ///< in plain words
    std::string remedy;           ///< what to do; empty where there is nothing
};

/// A device that is attached.
struct AttachedDevice {
    std::string path;          ///< its node, /dev/hidraw0; or its place on the bus
    std::uint16_t vendor = 0;  ///< USB ids
    std::uint16_t product = 0; ///< the same, of the maker named by `vendor`
    std::string name;          ///< maker and model as it says itself, else as it is known
    AttachedKind kind = AttachedKind::other; ///< whether and how Palpate can use it
    std::vector<DeviceFinding> findings;     ///< obstacles first
    DeviceWay way{};                         ///< of foreign devices
    std::string called{}; ///< of foreign devices: what `hid:` may call it, spaces between the names

    /// True when nothing is in the way of using it.                                      [any]
    bool usable() const;
};

/// How scenes call the first device of a kind, behind "hid:": wooden, spacemouse, forcefeedback;
/// empty for kinds that are not ours.                                                     [any]
std::string address_of(AttachedKind kind);

/// Everything attached that is a HID device, the haptic devices that are none, and what of the
/// system's lists cannot be read. Opens and writes to no device; takes some ms. The environment's
/// PALPATE_SYSTEM_ROOT names a folder with another /sys, /proc and /dev: then they alone are looked
/// at, and hidapi is not asked.                                                         [setup]
std::vector<AttachedDevice> attached_devices();

/// The device that an address means: a kind's name, of which it is the first that is usable, or the
/// path of a node. Throws std::runtime_error with what is in the way and the remedy; of a foreign
/// device by its name (touch, falcon, omega, ..), what leads to it.                     [setup]
AttachedDevice device_at(const std::string& address, const std::vector<AttachedDevice>& attached);

/// The udev rules that let a user who sits at the machine, or is in the group plugdev, use the
/// devices: the text of 70-palpate.rules.                                               [setup]
std::string udev_rules();

} // namespace palpate
