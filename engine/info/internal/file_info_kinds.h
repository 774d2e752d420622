// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/engine/info/file_info.h>

/// file_info() by the kind of file.                                                      [setup]
namespace palpate::internal {

FileInfo volume_info(const std::filesystem::path& file, const FileInfoSettings& settings);
FileInfo mesh_info(const std::filesystem::path& path, const FileInfoSettings& settings);
FileInfo scene_info(const std::filesystem::path& file);
FileInfo recording_info(const std::filesystem::path& file);

} // namespace palpate::internal
