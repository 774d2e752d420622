// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/drivers/plugin_device.h>
#include <palpate/engine/devices/device_list.h>
#include <palpate/engine/devices/internal/inverse_service_json.h>
#include <palpate/engine/text/internal/json_text.h>
#include <palpate/engine/text/plain_text.h>

namespace palpate {
namespace {

using Weight = DeviceFinding::Weight;

std::string_view in_words(AttachedKind kind) {
    switch (kind) {
    case AttachedKind::wooden_haptics:
        return "three-dimensional force";
    case AttachedKind::space_mouse:
        return "moves the probe by its deflection, no force";
    case AttachedKind::force_feedback:
        return "two-dimensional force";
    case AttachedKind::foreign:
        return "a haptic device of another maker's protocol";
    case AttachedKind::unseen:
        return "cannot be looked at";
    case AttachedKind::other:
        break;
    }
    return "not a haptic device";
}

std::string_view json_name(AttachedKind kind) {
    switch (kind) {
    case AttachedKind::wooden_haptics:
        return "wooden_haptics";
    case AttachedKind::space_mouse:
        return "space_mouse";
    case AttachedKind::force_feedback:
        return "force_feedback";
    case AttachedKind::foreign:
        return "foreign";
    case AttachedKind::unseen:
        return "unseen";
    case AttachedKind::other:
        break;
    }
    return "other";
}

/// What scenes call it: by kind where there is one of the kind, else by node.
std::string address_in(const std::vector<AttachedDevice>& devices, const AttachedDevice& device) {
    const auto same = std::count_if(devices.begin(), devices.end(), [&](const AttachedDevice& one) {
        return one.kind == device.kind && one.usable();
    });
    const std::string address = "hid:" + (same == 1 ? address_of(device.kind) : device.path);
    // Which build it is, only its owner knows.
    return device.kind == AttachedKind::wooden_haptics ? address + ":MODEL" : address;
}

std::string line_of(const std::vector<AttachedDevice>& devices, const AttachedDevice& device) {
    if (device.kind == AttachedKind::unseen)
        return fmt::format("{}: {} {}\n", device.path, device.name, in_words(device.kind));
    const std::string ids = fmt::format("{:04x}:{:04x}", device.vendor, device.product);
    const std::string outcome = device.usable()                      ? address_in(devices, device)
                                : device.kind == AttachedKind::other ? "-"
                                : !device.way.by.empty()             ? "by " + device.way.by
                                                                     : "NOT USABLE";
    return fmt::format("{}  {}  {}: {}  {}\n", plain_text(device.path), ids,
                       plain_text(device.name), in_words(device.kind), plain_text(outcome));
}

std::string findings_of(const AttachedDevice& device) {
    std::string text;
    for (const DeviceFinding& finding : device.findings) {
        text +=
            fmt::format("    {}: {}\n", finding.weight == Weight::obstacle ? "in the way" : "note",
                        plain_text(finding.what));
        if (!finding.remedy.empty())
            text += fmt::format("    remedy: {}\n", plain_text(finding.remedy));
    }
    return text;
}

std::string line_of(const ListedPlugin& plugin) {
    if (!plugin.obstacle.empty()) return plain_text(plugin.obstacle) + "\n";
    const std::string path = plain_text(plugin.path);
    return fmt::format("{}  {}: plug-in  plugin:{}\n", path, plain_text(plugin.name), path);
}

} // namespace

std::vector<ListedPlugin> listed_plugins(const std::vector<std::string>& files) {
    std::vector<ListedPlugin> listed;
    listed.reserve(files.size());
    for (const std::string& file : files) {
        ListedPlugin one{std::filesystem::absolute(file).string(), "", ""};
        try {
            const PluginName said = plugin_name(one.path);
            one.name = said.name + " " + said.version;
        } catch (const std::runtime_error& error) {
            one.obstacle = error.what();
        }
        listed.push_back(std::move(one));
    }
    return listed;
}

std::string device_list_text(const std::vector<AttachedDevice>& devices, DeviceListDetail detail,
                             const std::vector<ListedPlugin>& plugins,
                             const ListedInverseService* service) {
    std::string text;
    std::size_t ours = 0, others = 0, unusable = 0;
    bool is_all = true;
    for (const AttachedDevice& device : devices) {
        const bool other = device.kind == AttachedKind::other;
        const bool unseen = device.kind == AttachedKind::unseen;
        is_all = is_all && !unseen;
        if (!unseen) ++(other ? others : ours);
        if (!other && !device.usable()) ++unusable;
        if (other && detail == DeviceListDetail::brief) continue;
        text += line_of(devices, device);
        if (detail == DeviceListDetail::why) text += findings_of(device);
    }
    for (const ListedPlugin& plugin : plugins) {
        text += line_of(plugin);
        if (plugin.obstacle.empty()) ++ours;
    }
    if (service != nullptr) {
        text += detail == DeviceListDetail::why ? inverse_service_why(*service)
                                                : inverse_service_text(*service);
        ours += service->found.devices.size();
        unusable += service->found.devices.size() - usable_devices(*service);
    }
    if (ours == 0)
        text += (is_all ? "no haptic device is attached" : "no haptic device was found") +
                std::string("; a path, an orbit, a tour, a recording or the simulated hand serves "
                            "as well: --device path:FILE, orbit, tour, recording:FILE, hand\n");
    if (detail == DeviceListDetail::why && ours > 0)
        text += "feel with a device: palpate trace SCENE --pace realtime --device ADDRESS, the "
                "last word of its line, or what its remedy leads to\n";
    if (detail == DeviceListDetail::brief && unusable > 0)
        text += "`palpate devices --why` says why something is not usable, and what helps\n";
    if (detail == DeviceListDetail::brief && others > 0)
        text += fmt::format("and {} other HID device{} (`--why` lists {})\n", others,
                            others == 1 ? "" : "s", others == 1 ? "it" : "them");
    return text;
}

std::string device_list_json(const std::vector<AttachedDevice>& devices,
                             const std::vector<ListedPlugin>& plugins,
                             const ListedInverseService* service) {
    nlohmann::json list = nlohmann::json::array();
    for (const AttachedDevice& device : devices) {
        nlohmann::json findings = nlohmann::json::array();
        for (const DeviceFinding& finding : device.findings)
            findings.push_back(
                {{"weight", finding.weight == Weight::obstacle ? "obstacle" : "note"},
                 {"what", finding.what},
                 {"remedy", finding.remedy}});
        nlohmann::json one = {{"path", device.path},
                              {"vendor", fmt::format("{:04x}", device.vendor)},
                              {"product", fmt::format("{:04x}", device.product)},
                              {"name", device.name},
                              {"kind", json_name(device.kind)},
                              {"usable", device.usable()},
                              {"address", nullptr},
                              {"way", nullptr},
                              {"findings", std::move(findings)}};
        if (device.usable()) one["address"] = address_in(devices, device);
        if (!device.way.by.empty())
            one["way"] = {
                {"by", device.way.by}, {"page", device.way.page}, {"tested", device.way.tested}};
        list.push_back(std::move(one));
    }
    nlohmann::json named = nlohmann::json::array();
    for (const ListedPlugin& plugin : plugins) {
        const bool is_usable = plugin.obstacle.empty();
        named.push_back({{"path", plugin.path},
                         {"name", plugin.name},
                         {"usable", is_usable},
                         {"address", nullptr},
                         {"obstacle", plugin.obstacle}});
        if (is_usable) named.back()["address"] = "plugin:" + plugin.path;
    }
    nlohmann::json all = {{"devices", std::move(list)}, {"plugins", std::move(named)}};
    if (service != nullptr) all["inverse_service"] = internal::inverse_service_json(*service);
    return internal::json_text(all);
}

} // namespace palpate
