// SPDX-License-Identifier: Apache-2.0
#include <array>

#include <palpate/engine/command/command.h>
#include <palpate/engine/info/phantom.h>
#include <palpate/volume/formats/volume_file.h>

namespace palpate::command {

void add_phantom(CLI::App& app, Action& run) {
    struct Options {
        std::string file;
        Replace replace = Replace::own;
    };
    const auto options = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand(
        "phantom", "writes a generated CT of a bumpy, grooved shell: a volume to try things on");
    command->add_option("FILE", options->file, ".nrrd, .nii or .nii.gz to write")->required();
    add_force(*command, options->replace);
    command->callback([options, &run] {
        run = [options] {
            const std::filesystem::path& file = options->file;
            check_outputs(std::array{file}, {}, options->replace);
            write_volume(make_phantom(), file);
            print(options->file + ": bone is at 226");
            return kDone;
        };
    });
}

} // namespace palpate::command
