// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include <palpate/engine/scene/scene_description.h>

namespace palpate::command {

/// Options of every command that reads a volume; spelled as the keys of a scene.
struct VolumeOptions {
    std::string file;
    std::string labels; ///< name table
    std::string series;
    std::string grid;
    std::string slices = "refuse";
    std::string nifti_transform = "automatic";
};

/// Adds --labels, --series, --grid, --slices and --nifti-transform.
void add_volume_options(CLI::App& command, VolumeOptions& options);

/// What the options say; a name table that does not exist is a usage error.
VolumeDescription described(const VolumeOptions& options);

} // namespace palpate::command
