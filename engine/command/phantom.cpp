// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/command/command.h>
#include <palpate/engine/phantom.h>
#include <palpate/volume/volume_file.h>

namespace palpate::command {

void add_phantom(CLI::App& app, Run& run) {
    const auto file = std::make_shared<std::string>();
    CLI::App* command = app.add_subcommand(
        "phantom", "writes a generated CT of a bumpy, grooved shell: a volume to try things on");
    command->add_option("FILE", *file, ".nrrd, .nii or .nii.gz to write")->required();
    command->callback([file, &run] {
        run = [file] {
            write_volume(make_phantom(), *file);
            print(*file + ": bone is at 226");
            return kDone;
        };
    });
}

} // namespace palpate::command
