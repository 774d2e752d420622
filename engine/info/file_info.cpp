// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/info/file_info.h>

#include <stdexcept>

#include <palpate/engine/info/internal/file_info_kinds.h>
#include <palpate/engine/record/recording.h>
#include <palpate/geometry/formats/mesh_file.h>
#include <palpate/geometry/internal/lower_case.h>

namespace palpate {
FileInfo file_info(const std::filesystem::path& file, const FileInfoSettings& settings) {
    std::error_code ignored;
    if (!std::filesystem::exists(file, ignored))
        throw std::runtime_error(file.string() + ": does not exist; check its name");
    const std::string ending = internal::lower_case_ending(file);
    if (is_mesh_name(file)) return internal::mesh_info(file, settings);
    if (ending == ".toml") return internal::scene_info(file);
    const bool is_folder = std::filesystem::is_directory(file, ignored);
    if (is_folder && std::filesystem::exists(found_recording(file / "recording.h5"), ignored))
        return internal::recording_info(file / "recording.h5"); // a run's
    if (ending == ".h5" || (!is_folder && is_journal(file))) return internal::recording_info(file);
    return internal::volume_info(file, settings);
}

} // namespace palpate
