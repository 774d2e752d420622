// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <string_view>
#include <system_error>

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
    if (std::find(kOurs.begin(), kOurs.end(), kind) == kOurs.end()) return false;
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
    case AttachedKind::unseen:
        break;
    }
    return {};
}

std::vector<AttachedDevice> attached_devices() {
    const char* root = std::getenv("PALPATE_SYSTEM_ROOT");
    const internal::SystemFolders system =
        root != nullptr ? internal::system_folders(root) : internal::SystemFolders{};
    const std::vector<internal::HidEvidence> nodes = internal::hid_evidence(
        root != nullptr ? std::vector<internal::HidDeviceInfo>{} : internal::attached_hid_devices(),
        system);
    std::vector<AttachedDevice> devices;
    devices.reserve(nodes.size());
    for (const internal::HidEvidence& node : nodes)
        devices.push_back(internal::judged(node));
    for (const internal::UsbEvidence& evidence : internal::usb_evidence(system))
        if (const auto device = internal::judged(evidence, nodes)) devices.push_back(*device);
    if (const auto unseen = internal::unseen_usb(system)) devices.push_back(*unseen);
    return devices;
}

namespace {

/// Whether a path leads to a node: a link of udev's does, too.
bool is_node(const std::string& node, const std::string& path) {
    std::error_code failed;
    return node == path || std::filesystem::equivalent(node, path, failed);
}

/// The end of a message about `address`, of which none is attached.
std::string none_attached(const std::vector<AttachedDevice>& attached) {
    for (const AttachedDevice& one : attached)
        if (one.kind == AttachedKind::unseen)
            return ": none was found, and " + one.findings.front().what + "; " +
                   one.findings.front().remedy;
    return ": none is attached; plug it in, `palpate devices` lists what is";
}

/// "usb 1-4 is a 3D Systems Touch (2988:0302): what is in the way; the remedy".
[[noreturn]] void refuse_foreign(const AttachedDevice& device) {
    char ids[16];
    std::snprintf(ids, sizeof ids, " (%04x:%04x): ", device.vendor, device.product);
    const DeviceFinding& first = device.findings.front();
    throw std::runtime_error(device.path + " is a " + device.name + ids + first.what + "; " +
                             first.remedy);
}

} // namespace

AttachedDevice device_at(const std::string& address, const std::vector<AttachedDevice>& attached) {
    const bool is_path = address.starts_with('/');
    const bool is_foreign =
        std::any_of(internal::foreign_products().begin(), internal::foreign_products().end(),
                    [&](const internal::ForeignProduct& one) {
                        return internal::has_word(one.called, address);
                    });
    if (!is_path && !is_foreign && std::none_of(kOurs.begin(), kOurs.end(), [&](AttachedKind kind) {
            return address_of(kind) == address;
        }))
        throw std::runtime_error("hid:" + address +
                                 ": no such kind of device; give wooden, "
                                 "spacemouse, forcefeedback or a node as "
                                 "`palpate devices` lists it");
    const AttachedDevice* found = nullptr;
    for (const AttachedDevice& device : attached) {
        if (is_foreign && internal::has_word(device.called, address)) refuse_foreign(device);
        const bool meant = is_path ? is_node(device.path, address)
                                   : !is_foreign && address_of(device.kind) == address;
        if (meant && device.usable()) return device;
        if (meant && found == nullptr) found = &device;
    }
    if (found == nullptr) throw std::runtime_error("hid:" + address + none_attached(attached));
    if (found->kind == AttachedKind::foreign) refuse_foreign(*found);
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
