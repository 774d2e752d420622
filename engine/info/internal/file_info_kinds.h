// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <variant>

#include <palpate/engine/info/file_info.h>
#include <palpate/volume/label_volume.h>
#include <palpate/volume/voxel_volume.h>

/// file_info() by the kind of file.                                                      [setup]
namespace palpate::internal {

FileInfo volume_info(const std::filesystem::path& file, const FileInfoSettings& settings);
FileInfo mesh_info(const std::filesystem::path& path, const FileInfoSettings& settings);
FileInfo scene_info(const std::filesystem::path& file);
FileInfo recording_info(const std::filesystem::path& file);

/// One volume of numbers: measured, or labels.
using ValuesOrLabels = std::variant<VoxelVolume, LabelVolume>;

/// A scalar volume, or labels where it is a .seg.nrrd, a name table is given or lies beside it, or
/// it looks like them. Throws as read_volume() and read_label_volume().
ValuesOrLabels read_values_or_labels(const std::filesystem::path& file,
                                     const FileInfoSettings& settings);

} // namespace palpate::internal
