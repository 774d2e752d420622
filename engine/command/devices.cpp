// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

#include <palpate/engine/command/command.h>
#include <palpate/engine/devices/device_list.h>

namespace palpate::command {
namespace {

struct DeviceOptions {
    bool why = false;
    bool json = false;
    bool rules = false;
    std::vector<std::string> plugins;
    std::string inverse_service;
};

/// Those that are given, and those in PALPATE_DEVICE_PLUGINS, with colons between them.
std::vector<std::string> named_plugins(std::vector<std::string> files) {
    const char* named = std::getenv("PALPATE_DEVICE_PLUGINS");
    const std::string list = named != nullptr ? named : "";
    for (std::size_t at = 0; at < list.size();) {
        const std::size_t end = std::min(list.find(':', at), list.size());
        if (end > at) files.push_back(list.substr(at, end - at));
        at = end + 1;
    }
    return files;
}

ListedInverseService asked_service(const std::string& where) {
    try {
        return listed_inverse_service(where);
    } catch (const std::runtime_error&) { // it speaks of an address inverse3?host=
        throw UsageError(fmt::format("--inverse-service {}: is no address; give one in digits, or "
                                     "one with a port, as 127.0.0.1:10001",
                                     where));
    }
}

int devices(const DeviceOptions& options) {
    if (options.rules) {
        print(udev_rules());
        return kDone;
    }
    const std::vector<AttachedDevice> attached = attached_devices();
    const std::vector<ListedPlugin> plugins = listed_plugins(named_plugins(options.plugins));
    const ListedInverseService service = asked_service(options.inverse_service);
    print(options.json
              ? device_list_json(attached, plugins, &service)
              : device_list_text(attached,
                                 options.why ? DeviceListDetail::why : DeviceListDetail::brief,
                                 plugins, &service));
    return kDone;
}

} // namespace

void add_devices(CLI::App& app, Action& run) {
    const auto options = std::make_shared<DeviceOptions>();
    CLI::App* command =
        app.add_subcommand("devices", "what is attached, and why something is not usable");
    CLI::Option* why = command->add_flag(
        "--why", options->why, "what is in the way of each device, and what to do about it");
    CLI::Option* json =
        command->add_flag("--json", options->json, "as JSON, with every finding")->excludes(why);
    CLI::Option* plugins =
        command->add_option("--plugin", options->plugins,
                            "files of device plug-ins, which are loaded, beside those that "
                            "PALPATE_DEVICE_PLUGINS names with colons between them");
    CLI::Option* service =
        command->add_option("--inverse-service", options->inverse_service,
                            "HOST or HOST:PORT of the Inverse Service to ask for an Inverse3, as "
                            "numbers (default: 127.0.0.1:10001)");
    command
        ->add_flag("--udev-rules", options->rules,
                   "print the rules that let you use the devices without being root")
        ->excludes(json)
        ->excludes(why)
        ->excludes(plugins)
        ->excludes(service);
    command->callback([options, &run] { run = [options] { return devices(*options); }; });
}

} // namespace palpate::command
