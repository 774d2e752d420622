// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/devices/inverse_service_list.h>

#include <algorithm>

#include <fmt/format.h>

#include <palpate/engine/devices/internal/inverse_service_json.h>
#include <palpate/engine/text/plain_text.h>

namespace palpate {
namespace {

using Answer = InverseService::Answer;

std::string place(const ListedInverseService& service) {
    return plain_text(fmt::format("{}:{}", service.address.host, service.address.port));
}

/// "Haply inverse3 049D (right)"
std::string name_of(const ListedInverse3& device) {
    return fmt::format("Haply {} {}{}", device.type.empty() ? "inverse3" : device.type,
                       device.device_id,
                       device.handedness.empty() ? "" : " (" + device.handedness + ")");
}

std::string line_of(const ListedInverseService& service, const ListedInverse3& device) {
    return fmt::format("{}  {}: three-dimensional force  {}\n", place(service), name_of(device),
                       device.is_calibrated ? address_of(service, device) : "NOT USABLE");
}

std::string findings_of(const ListedInverse3& device) {
    std::string text;
    if (!device.is_calibrated)
        text += "    in the way: it is not calibrated, so its positions are of no use\n"
                "    remedy: put the grip on its rest until the light is steady\n";
    if (!device.has_power)
        text += "    note: its service says that it has no power supply, so it may not push\n"
                "    remedy: plug its power supply in\n";
    if (device.is_in_use)
        text += "    note: another program uses it, and the forces of both are added\n"
                "    remedy: end that program\n";
    return text;
}

constexpr const char* kUse =
    "    remedy: an Inverse3 is used through Haply's Inverse Service: start Haply Hub, or `sudo "
    "systemctl start haply-inverse-service`; its device is then inverse3 in a scene and for "
    "--device\n";

} // namespace

ListedInverseService listed_inverse_service(const std::string& where) {
    constexpr double kPatience_s = 2.0;
    ListedInverseService listed;
    listed.is_named = !where.empty();
    // One colon is that of a port; more are those of an IPv6 address.
    const std::size_t colon = where.rfind(':');
    const bool has_port = colon != std::string::npos && where.find(':') == colon;
    if (!where.empty())
        listed.address =
            inverse3_address(has_port ? fmt::format("?host={}&port={}", where.substr(0, colon),
                                                    where.substr(colon + 1))
                                      : fmt::format("?host={}", where));
    listed.found = ask_inverse_service(listed.address, kPatience_s);
    return listed;
}

std::string address_of(const ListedInverseService& service, const ListedInverse3& device) {
    const Inverse3Address usual;
    std::string options;
    const auto add = [&](const std::string& option) {
        options += (options.empty() ? "?" : "&") + option;
    };
    if (service.address.host != usual.host) add("host=" + service.address.host);
    if (service.address.port != usual.port) add(fmt::format("port={}", service.address.port));
    return "inverse3:" + device.device_id + options;
}

std::size_t usable_devices(const ListedInverseService& service) {
    const auto& devices = service.found.devices;
    return static_cast<std::size_t>(
        std::count_if(devices.begin(), devices.end(),
                      [](const ListedInverse3& device) { return device.is_calibrated; }));
}

std::string inverse_service_text(const ListedInverseService& service) {
    if (service.found.answer != Answer::service)
        return service.is_named ? inverse_service_why(service) : "";
    if (service.found.devices.empty())
        return fmt::format("{}  Haply Inverse Service: it has no device\n", place(service));
    std::string text;
    for (const ListedInverse3& device : service.found.devices)
        text += line_of(service, device);
    return text;
}

std::string inverse_service_why(const ListedInverseService& service) {
    switch (service.found.answer) {
    case Answer::nobody:
        return fmt::format("{}  Haply Inverse Service: it does not answer ({})\n{}", place(service),
                           service.found.reason, kUse);
    case Answer::stranger:
        return fmt::format("{}  another program, and no Inverse Service of version 3.1 or later: "
                           "{}\n{}",
                           place(service), service.found.reason, kUse);
    case Answer::service:
        break;
    }
    if (service.found.devices.empty())
        return inverse_service_text(service) +
               "    in the way: an Inverse3 is not plugged in, or off\n"
               "    remedy: plug it in; Haply Hub shows whether its service sees it\n";
    std::string text;
    for (const ListedInverse3& device : service.found.devices)
        text += line_of(service, device) + findings_of(device);
    return text;
}

nlohmann::json internal::inverse_service_json(const ListedInverseService& service) {
    nlohmann::json devices = nlohmann::json::array();
    for (const ListedInverse3& device : service.found.devices) {
        devices.push_back({{"device_id", device.device_id},
                           {"type", device.type},
                           {"handedness", device.handedness},
                           {"calibrated", device.is_calibrated},
                           {"power", device.has_power},
                           {"in_use", device.is_in_use},
                           {"usable", device.is_calibrated},
                           {"address", nullptr}});
        if (device.is_calibrated) devices.back()["address"] = address_of(service, device);
    }
    const char* const answers[] = {"nobody", "stranger", "service"};
    return {{"address", place(service)},
            {"answer", answers[static_cast<std::size_t>(service.found.answer)]},
            {"reason", service.found.reason},
            {"grips", service.found.grips},
            {"devices", std::move(devices)}};
}

} // namespace palpate
