// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/internal/device_addresses.h>

#include <stdexcept>

#include <palpate/drivers/igtl_device.h>
#include <palpate/drivers/inverse3_service.h>
#include <palpate/drivers/plugin_device.h>

namespace palpate::internal {

void check_address(const DeviceDescription& device) {
    using Kind = DeviceDescription::Kind;
    try {
        if (device.kind == Kind::igtl) igtl_address(device.address);
        if (device.kind == Kind::inverse3) inverse3_address(device.address);
        if (device.kind == Kind::plugin) plugin_address(device.address);
    } catch (const std::runtime_error& error) { // as of a device that cannot be used
        throw std::invalid_argument(error.what());
    }
}

} // namespace palpate::internal
