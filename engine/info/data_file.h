// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <variant>

#include <palpate/engine/info/file_info.h>
#include <palpate/geometry/formats/mesh_file.h>
#include <palpate/volume/label_volume.h>
#include <palpate/volume/voxel_volume.h>

namespace palpate {

/// Data that a surface can be made of, read as what they are.
struct DataFile {
    std::filesystem::path file;   ///< or a DICOM folder; as it was given
    VolumeSelection selection;    ///< that it was read with
    std::filesystem::path labels; ///< table that names the labels; empty: the file's own, or none
    std::variant<VoxelVolume, LabelVolume, MeshFile> content; ///< scene frame (LPS), m
};

/// Reads a volume of values, labels or a mesh, told apart as file_info() does.            [setup]
/// `settings`: selection, labels and mesh alone count.
/// Throws std::runtime_error "FILE[:LINE]: what is wrong; what to do": as read_volume(),
/// read_label_volume() and read_mesh(); a file of vectors; a scene or a recording.
DataFile read_data_file(const std::filesystem::path& file, const FileInfoSettings& settings = {});

} // namespace palpate
