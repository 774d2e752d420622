// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include <palpate/engine/info/file_info.h>
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
    std::string reference;
};

/// Adds --labels, --series, --grid, --slices and --nifti-transform.
void add_volume_options(CLI::App& command, VolumeOptions& options);

/// What the options say; a name table that does not exist is a usage error.
VolumeDescription described(const VolumeOptions& options);

/// Options of commands that read a mesh as well; spelled as the keys of a scene.
struct MeshOptions {
    std::string frame; ///< LPS, RAS; empty: as the file says
    std::string unit;  ///< mm, m; empty: as the file says
};

/// Adds --mesh-frame and --mesh-unit.
void add_mesh_options(CLI::App& command, MeshOptions& options);

/// Refuses an option that is for volumes where the file is none, by its name: a usage error.
void require_volume(const VolumeOptions& volume, const char* option, bool is_given);

/// How a volume or a mesh is to be read. Refuses options of meshes for what is none, by its name,
/// and those of volumes likewise; and a name table as described() does: usage errors.
FileInfoSettings read_settings(const VolumeOptions& volume, const MeshOptions& mesh);

} // namespace palpate::command
