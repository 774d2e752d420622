// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <palpate/drivers/attached_devices.h>

namespace palpate::test {

/// What is said of a device with these words; null where nothing is.
inline const DeviceFinding* finding(const AttachedDevice& device, DeviceFinding::Weight weight,
                                    const std::string& part) {
    for (const DeviceFinding& one : device.findings)
        if (one.weight == weight && (one.what + one.remedy).find(part) != std::string::npos)
            return &one;
    return nullptr;
}

} // namespace palpate::test
