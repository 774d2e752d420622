// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/command/command.h>
#include <palpate/engine/devices/device_list.h>

namespace palpate::command {
namespace {

struct DeviceOptions {
    bool why = false;
    bool json = false;
    bool rules = false;
};

int devices(const DeviceOptions& options) {
    if (options.rules) {
        print(udev_rules());
        return kDone;
    }
    const std::vector<AttachedDevice> attached = attached_devices();
    print(options.json ? device_list_json(attached)
                       : device_list_text(attached, options.why ? DeviceListDetail::why
                                                                : DeviceListDetail::brief));
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
    command
        ->add_flag("--udev-rules", options->rules,
                   "print the rules that let you use the devices without being root")
        ->excludes(json)
        ->excludes(why);
    command->callback([options, &run] { run = [options] { return devices(*options); }; });
}

} // namespace palpate::command
