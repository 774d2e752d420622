// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/label_file.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <utility>

#include <palpate/volume/formats/internal/component_image.h>
#include <palpate/volume/formats/internal/dicom_labels.h>
#include <palpate/volume/formats/internal/label_names.h>
#include <palpate/volume/formats/internal/segmentation.h>
#include <palpate/volume/formats/internal/volume_import.h>

namespace palpate {
namespace {

bool ends_with(const std::string& name, const std::string& ending) {
    return name.size() > ending.size() && name.ends_with(ending);
}

bool is_nrrd(const std::filesystem::path& file) {
    const std::string name = file.filename().string();
    return ends_with(name, ".nrrd") || ends_with(name, ".nhdr");
}

/// Names of a table that nobody asked for: what cannot be read is a warning.
internal::LabelNames names_beside(const std::filesystem::path& file, LabelVolume& volume) {
    const std::filesystem::path table = find_name_table(file);
    if (table.empty()) return {};
    try {
        internal::LabelNames names = internal::read_label_names(table);
        volume.name_table = table;
        return names;
    } catch (const std::runtime_error& error) {
        volume.warnings.push_back(std::string("the table of names beside it is left out: ") +
                                  error.what());
        return {};
    }
}

/// Colour tables of other programs have the endings of tables of names, but are binary.
bool is_text(const std::filesystem::path& file) {
    std::array<char, 1024> start{};
    std::ifstream input(file, std::ios::binary);
    input.read(start.data(), start.size());
    return std::find(start.begin(), start.begin() + input.gcount(), '\0') ==
           start.begin() + input.gcount();
}

/// A scalar volume of whole numbers, its values not yet named.
LabelVolume as_labels(const std::filesystem::path& file, VoxelVolume&& image) {
    LabelVolume volume;
    volume.size = image.size;
    volume.index_to_scene = image.index_to_scene;
    volume.source_type = std::move(image.source_type);
    volume.warnings = std::move(image.warnings);
    volume.layers.push_back(internal::whole_numbers(file, image.size, image.values));
    return volume;
}

} // namespace

bool is_named_segmentation(const std::filesystem::path& file) {
    const std::string name = file.filename().string();
    return name.ends_with(".seg.nrrd") || name.ends_with(".seg.nhdr");
}

bool holds_labels(const std::filesystem::path& file) {
    return is_named_segmentation(file) ||
           internal::dicom_labels_of(file) != internal::DicomLabels::none;
}

bool is_name_table(const std::filesystem::path& file) {
    try {
        internal::read_label_names(file);
        return true;
    } catch (const std::runtime_error&) {
        return false;
    }
}

bool needs_reference(const std::filesystem::path& file) {
    return internal::dicom_labels_of(file) == internal::DicomLabels::structure_set;
}

LabelVolume read_label_volume(const std::filesystem::path& file,
                              const std::filesystem::path& name_table,
                              const VolumeSelection& selection) {
    // First, since it is read in no time: a typing error is told before a large file is read.
    internal::LabelNames names;
    if (!name_table.empty()) names = internal::read_label_names(name_table);

    if (const internal::DicomLabels kind = internal::dicom_labels_of(file);
        kind != internal::DicomLabels::none) {
        internal::require_choices(file, selection);
        return kind == internal::DicomLabels::segmentation
                   ? internal::read_dicom_segmentation(file, names)
                   : internal::read_dicom_structures(file, names, selection);
    }
    LabelVolume volume;
    std::error_code ignored; // what is no file, read_volume() refuses
    if (is_nrrd(file) && std::filesystem::is_regular_file(file, ignored)) {
        internal::require_choices(file, selection);
        internal::ComponentImage image = internal::read_nrrd_image(file);
        if (internal::is_segmentation(image))
            return internal::read_segmentation(file, std::move(image), names);
        volume = as_labels(file, internal::as_scalar_volume(file, std::move(image)));
    } else {
        volume = as_labels(file, read_volume(file, selection));
    }
    if (name_table.empty()) names = names_beside(file, volume);
    internal::add_labels(volume, 0, names);
    return volume;
}

std::filesystem::path find_name_table(const std::filesystem::path& file) {
    const std::string name = file.filename().string();
    std::vector<std::string> stems{name}; // "aal.nii.gz", "aal.nii", "aal"
    for (const std::string ending : {".gz", ".nii", ".nrrd", ".seg", ".nhdr", ".mha", ".mhd"})
        if (ends_with(stems.back(), ending))
            stems.push_back(stems.back().substr(0, stems.back().size() - ending.size()));
    if (stems.size() == 1) return {}; // a folder of slices, or no volume
    for (const std::string& stem : stems)
        for (const char* ending : {".txt", ".label", ".lut", ".ctbl", ".tsv"}) {
            std::filesystem::path table = file.parent_path() / (stem + ending);
            std::error_code ignored;
            if (std::filesystem::is_regular_file(table, ignored) && is_text(table)) return table;
        }
    return {};
}

} // namespace palpate
