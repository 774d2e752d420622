// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <palpate/drivers/attached_devices.h>
#include <palpate/drivers/haptic_device.h>

namespace palpate {

/// The device of an address, which is what stands behind "hid:" in a scene; not open yet:
///
///     spacemouse                       the first usable device of a kind
///     /dev/hidraw3                     that one, whatever it is
///     wooden:polhem_v3                 of the WoodenHaptics family also the build that it is, by
///     the /dev/hidraw3:/home/me/own.json   name of a model that comes with us or its file
///
/// Throws std::runtime_error with what is in the way and the remedy: no such device, no permission,
/// no model.                                                                            [setup]
std::unique_ptr<HapticDevice> make_hid_device(const std::string& address,
                                              const std::vector<AttachedDevice>& attached);

/// Whether such a device may say nothing and be sound: a stick may, while it rests.      [setup]
bool may_rest(const HapticDevice& device) noexcept;

} // namespace palpate
