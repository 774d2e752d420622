// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <palpate/drivers/attached_devices.h>
#include <palpate/engine/devices/inverse_service_list.h>

namespace palpate {

/// How much is told of devices that cannot be used.
enum class DeviceListDetail {
    brief, ///< what is usable, and that something is not
    why    ///< every finding with its remedy, and what is none of ours
};

/// A device plug-in that a user named.
struct ListedPlugin {
    std::string path;     ///< absolute
    std::string name;     ///< what it says of itself, as "udp 1.0"; empty: it cannot be used
    std::string obstacle; ///< what is wrong with the file and what to do; empty: nothing
};

/// Loads plug-ins' files, for as long as the program runs, and opens no device.           [setup]
std::vector<ListedPlugin> listed_plugins(const std::vector<std::string>& files);

/// What is attached, in plain text with a line for each device; lines end with a newline. That no
/// haptic device is attached it says only where everything could be looked at. A `service` that is
/// null was not asked.                                                                     [any]
std::string device_list_text(const std::vector<AttachedDevice>& devices, DeviceListDetail detail,
                             const std::vector<ListedPlugin>& plugins = {},
                             const ListedInverseService* service = nullptr);

/// The same for programs: {"devices": [{path, vendor, product, name, kind, usable, address, way,
/// findings: [{weight, what, remedy}]}], "plugins": [{path, name, usable, address, obstacle}]}.
/// `address` is what scenes and --device take; null where the device is not usable. `way` is
/// {by, page, tested}: what leads to a device that Palpate has no driver for; else null. Where a
/// service was asked, also "inverse_service": {address, answer: nobody, stranger or service,
/// reason, grips, devices: [{device_id, type, handedness, calibrated, power, in_use, usable,
/// address}]}.                                                                             [any]
std::string device_list_json(const std::vector<AttachedDevice>& devices,
                             const std::vector<ListedPlugin>& plugins = {},
                             const ListedInverseService* service = nullptr);

} // namespace palpate
