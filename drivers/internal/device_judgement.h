// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <palpate/drivers/attached_devices.h>
#include <palpate/drivers/internal/hid_port.h>

namespace palpate::internal {

/// Whether this user may use a node.
enum class NodeAccess : std::uint8_t { granted, denied, missing };

/// What can be learnt of an attached HID device without opening it.
struct HidEvidence {
    std::vector<HidDeviceInfo> collections; ///< of one node, at least one
    std::vector<std::uint8_t> descriptor;   ///< empty where it cannot be had
    NodeAccess access = NodeAccess::granted;
    std::string owner;                ///< of the node, in words: "root:root, mode 0600"
    bool rules_installed = false;     ///< ours, for udev
    bool kernel_makes_forces = false; ///< hid-pidff has it too
    std::vector<std::string> holders; ///< programs that have it open: "spacenavd (process 812)"
};

/// What it is, and what is in the way of using it.                                        [any]
AttachedDevice judged(const HidEvidence& evidence);

/// A device on the USB, whatever it speaks.
struct UsbEvidence {
    std::string place; ///< on the bus: "usb 1-4"
    std::uint16_t vendor = 0;
    std::uint16_t product = 0;
    std::string name;     ///< as the device says, may be empty
    bool is_hid = false;  ///< one of its interfaces at least
    std::string node{};   ///< what a library opens: its serial port, or the device itself
    bool is_port = false; ///< `node` is a serial port
    NodeAccess access = NodeAccess::missing; ///< of `node`
    std::string owner{};                     ///< of `node`, in words
};

/// A haptic device that is known and cannot be used as it is, since Palpate has no driver for it or
/// it is not among the kernel's `nodes`; nothing where it is neither.                     [any]
std::optional<AttachedDevice> judged(const UsbEvidence& evidence,
                                     const std::vector<HidEvidence>& nodes);

} // namespace palpate::internal
