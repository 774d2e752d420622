// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <palpate/drivers/attached_devices.h>

namespace palpate {

/// How much is told of devices that cannot be used.
enum class DeviceListDetail {
    brief, ///< what is usable, and that something is not
    why    ///< every finding with its remedy, and what is none of ours
};

/// What is attached, in plain text with a line for each device; lines end with a newline.   [any]
std::string device_list_text(const std::vector<AttachedDevice>& devices, DeviceListDetail detail);

/// The same for programs: {"devices": [{path, vendor, product, name, kind, usable, address,
/// findings: [{weight, what, remedy}]}]}. `address` is what scenes and --device take; null where
/// the device is not usable.                                                               [any]
std::string device_list_json(const std::vector<AttachedDevice>& devices);

} // namespace palpate
