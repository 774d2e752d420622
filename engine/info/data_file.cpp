// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/info/data_file.h>

#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include <palpate/engine/info/internal/file_info_kinds.h>
#include <palpate/engine/record/recording.h>
#include <palpate/geometry/internal/lower_case.h>
#include <palpate/volume/formats/label_file.h>
#include <palpate/volume/formats/vector_file.h>

namespace palpate {
namespace internal {

/// Labels are read again as whole numbers, so that the voxels are never in memory twice.
ValuesOrLabels read_values_or_labels(const std::filesystem::path& file,
                                     const FileInfoSettings& settings) {
    if (holds_labels(file) || !settings.labels.empty())
        return read_label_volume(file, settings.labels, settings.selection);
    VoxelVolume volume = read_volume(file, settings.selection);
    const std::filesystem::path table = find_name_table(file);
    if (!looks_like_labels(volume) && !is_name_table(table)) {
        if (!table.empty())
            volume.warnings.push_back("is not read as labels, though it has " +
                                      table.filename().string() +
                                      " beside it: that is no table of names");
        return volume;
    }
    volume = {};
    std::string reason;
    try {
        return read_label_volume(file, {}, settings.selection);
    } catch (const std::runtime_error& error) {
        reason = error.what();
    }
    volume = read_volume(file, settings.selection);
    volume.warnings.push_back("is not read as labels, though it " +
                              (table.empty() ? std::string("looks like them")
                                             : "has " + table.filename().string() + " beside it") +
                              " (" + reason + ")");
    return volume;
}

} // namespace internal

DataFile read_data_file(const std::filesystem::path& file, const FileInfoSettings& settings) {
    const auto refuse = [&](std::string_view what) {
        throw std::runtime_error(fmt::format("{}: {}", file.string(), what));
    };
    std::error_code ignored;
    if (!std::filesystem::exists(file, ignored)) refuse("does not exist; check its name");
    DataFile data{file, settings.selection, settings.labels, {}};
    const std::string ending = internal::lower_case_ending(file);
    if (is_mesh_name(file)) {
        data.content = read_mesh(file, settings.mesh);
        return data;
    }
    if (ending == ".toml") refuse("is a scene already; give a volume, labels or a mesh");
    if (ending == ".h5" || is_journal(file))
        refuse("is a recording; give a volume, labels or a mesh");
    if (!std::filesystem::is_directory(file, ignored) && holds_vectors(file, settings.selection))
        refuse("holds vectors or tensors, which have no surface; docs/effects.md has what is felt "
               "of them, as vector_follow and vector_force");
    std::visit([&](auto volume) { data.content = std::move(volume); },
               internal::read_values_or_labels(file, settings));
    if (const auto* labels = std::get_if<LabelVolume>(&data.content); data.labels.empty() && labels)
        data.labels = labels->name_table;
    return data;
}

} // namespace palpate
