// SPDX-License-Identifier: Apache-2.0
#include <stdexcept>

#include <fmt/format.h>

#include <palpate/drivers/pid_device.h>
#include <palpate/drivers/space_mouse.h>
#include <palpate/drivers/wooden_device.h>
#include <palpate/engine/devices/hid_device.h>
#include <palpate/engine/devices/wooden_models.h>

namespace palpate {
namespace {

/// With the arm of another build its forces would point anywhere: nobody's build is assumed.
std::unique_ptr<HapticDevice> wooden(const AttachedDevice& device, const std::string& model) {
    if (model.empty())
        throw std::runtime_error(
            fmt::format("{}: which build of the WoodenHaptics family it is, it does not say; give "
                        "hid:wooden:MODEL, MODEL a file .json or one of {}",
                        device.path, fmt::join(wooden_model_names(), ", ")));
    WoodenDevice::Settings settings;
    settings.path = device.path;
    return std::make_unique<WoodenDevice>(wooden_model(model), settings);
}

} // namespace

std::unique_ptr<HapticDevice> make_hid_device(const std::string& address,
                                              const std::vector<AttachedDevice>& attached) {
    const std::size_t colon = address.find(':');
    const std::string model = colon == std::string::npos ? "" : address.substr(colon + 1);
    const AttachedDevice device = device_at(address.substr(0, colon), attached);
    if (device.kind == AttachedKind::wooden_haptics) return wooden(device, model);
    if (colon != std::string::npos)
        throw std::runtime_error(fmt::format("hid:{}: {} is of no build; leave out what follows "
                                             "the colon",
                                             address, device.name));
    if (device.kind == AttachedKind::space_mouse) {
        SpaceMouseSettings settings;
        settings.path = device.path;
        return std::make_unique<SpaceMouseDevice>(settings);
    }
    PidSettings settings;
    settings.path = device.path;
    return std::make_unique<PidDevice>(settings);
}

bool may_rest(const HapticDevice& device) noexcept {
    return dynamic_cast<const PidDevice*>(&device) != nullptr;
}

} // namespace palpate
