// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <span>
#include <stdexcept>

#include <palpate/drivers/attached_devices.h>
#include <palpate/drivers/internal/device_judgement.h>
#include <palpate/drivers/internal/known_devices.h>
#include <palpate/drivers/internal/system_devices.h>

namespace palpate {
namespace {

constexpr std::array kOurs{AttachedKind::wooden_haptics, AttachedKind::space_mouse,
                           AttachedKind::force_feedback};

std::string rules_of(std::span<const internal::KnownProduct> products) {
    std::string rules;
    for (const internal::KnownProduct& one : products)
        rules += internal::udev_rule(one.vendor, one.product) + '\n';
    return rules;
}

} // namespace

bool AttachedDevice::usable() const {
    if (kind == AttachedKind::foreign || kind == AttachedKind::other) return false;
    return std::none_of(findings.begin(), findings.end(), [](const DeviceFinding& finding) {
        return finding.weight == DeviceFinding::Weight::obstacle;
    });
}

std::string address_of(AttachedKind kind) {
    switch (kind) {
    case AttachedKind::wooden_haptics:
        return "wooden";
    case AttachedKind::space_mouse:
        return "spacemouse";
    case AttachedKind::force_feedback:
        return "forcefeedback";
    case AttachedKind::foreign:
    case AttachedKind::other:
        break;
    }
    return {};
}

std::vector<AttachedDevice> attached_devices() {
    const std::vector<internal::HidEvidence> nodes =
        internal::hid_evidence(internal::attached_hid_devices());
    std::vector<AttachedDevice> devices;
    devices.reserve(nodes.size());
    for (const internal::HidEvidence& node : nodes)
        devices.push_back(internal::judged(node));
    for (const internal::UsbEvidence& evidence : internal::usb_evidence())
        if (const auto device = internal::judged(evidence, nodes)) devices.push_back(*device);
    return devices;
}

AttachedDevice device_at(const std::string& address, const std::vector<AttachedDevice>& attached) {
    const bool is_path = address.starts_with('/');
    if (!is_path && std::none_of(kOurs.begin(), kOurs.end(),
                                 [&](AttachedKind kind) { return address_of(kind) == address; }))
        throw std::runtime_error("hid:" + address +
                                 ": no such kind of device; give wooden, "
                                 "spacemouse, forcefeedback or a node as "
                                 "`palpate devices` lists it");
    const AttachedDevice* found = nullptr;
    for (const AttachedDevice& device : attached) {
        const bool meant = is_path ? device.path == address : address_of(device.kind) == address;
        if (meant && device.usable()) return device;
        if (meant && found == nullptr) found = &device;
    }
    if (found == nullptr)
        throw std::runtime_error("hid:" + address +
                                 ": none is attached; plug it in, `palpate "
                                 "devices` lists what is");
    // What is not usable has an obstacle; what is none of ours, a note at least.
    const DeviceFinding& first = found->findings.front();
    throw std::runtime_error(found->path + ": " + first.what +
                             (first.remedy.empty() ? "; `palpate devices` lists what is attached"
                                                   : "; " + first.remedy));
}

std::string udev_rules() {
    return "# SPDX-License-Identifier: Apache-2.0\n"
           "# Lets whoever sits at the machine, and the group plugdev, use the haptic devices that "
           "Palpate knows.\n"
           "# To /etc/udev/rules.d/70-palpate.rules; below 73, or uaccess comes too late. "
           "`palpate devices --udev-rules` prints it.\n"
           "# What is not among them needs a line like these: `palpate devices --why` gives it.\n"
           "\n# WoodenHaptics, AluHaptics, Vintage, Polhem\n" +
           rules_of(internal::wooden_products()) + "\n# 3Dconnexion\n" +
           rules_of(internal::space_mouse_products()) + "\n# Force feedback sticks\n" +
           rules_of(internal::force_feedback_products());
}

} // namespace palpate
