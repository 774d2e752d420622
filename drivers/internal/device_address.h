// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace palpate::internal {

/// PLACE, or PLACE?key=value&key=value: what stands behind the kind of a device.
struct DeviceAddress {
    std::string place; ///< may be empty
    std::vector<std::pair<std::string, std::string>> options;
};

/// Takes an address apart. `kind` is how messages begin it, as "plugin:". Throws
/// std::runtime_error where an option has no key, no "=", or is there twice.            [setup]
DeviceAddress device_address(const std::string& kind, const std::string& text);

} // namespace palpate::internal
