// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/info/segmented_folder.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <palpate/volume/formats/label_file.h>
#include <palpate/volume/formats/vector_file.h>

namespace palpate {
namespace {

std::vector<std::filesystem::path> files_of(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error))
        if (std::error_code ignored; entry.is_regular_file(ignored)) files.push_back(entry.path());
    if (error)
        throw std::runtime_error(fmt::format("{}: is a folder that cannot be read ({}); check its "
                                             "permissions",
                                             folder.string(), error.message()));
    std::sort(files.begin(), files.end());
    return files;
}

/// Whether a file or folder has a scalar volume; which one, of several.
bool has_image(const std::filesystem::path& file, VolumeSelection& selection) {
    try {
        for (const VolumeEntry& entry : list_volumes(file))
            if (entry.readable) {
                if (std::filesystem::is_directory(file)) selection.series = entry.selector;
                return true;
            }
    } catch (const std::runtime_error&) { // no volume, or one that is damaged: no image to use
        return false;
    }
    return false;
}

} // namespace

std::optional<SegmentedFolder> find_segmentation(const std::filesystem::path& folder) {
    const std::vector<std::filesystem::path> files = files_of(folder);
    std::vector<std::filesystem::path> labels;
    std::copy_if(files.begin(), files.end(), std::back_inserter(labels), holds_labels);
    if (labels.empty()) return std::nullopt;
    if (labels.size() > 1) {
        std::string names;
        for (const std::filesystem::path& file : labels)
            names += (names.empty() ? "" : ", ") + file.filename().string();
        throw std::runtime_error(fmt::format("{}: holds several segmentations: {}; name one of "
                                             "these files instead of the folder",
                                             folder.string(), names));
    }
    SegmentedFolder found{labels.front(), {}, {}};
    if (has_image(folder, found.image_selection)) {
        found.image = folder;
        return found;
    }
    for (const std::filesystem::path& file : files)
        if (file != found.labels && has_image(file, found.image_selection) &&
            !holds_vectors(file)) {
            found.image = file;
            break;
        }
    return found;
}

std::optional<VoxelVolume> image_around(const SegmentedFolder& folder, const LabelVolume& labels) {
    if (folder.image.empty()) return std::nullopt;
    VoxelVolume image = read_volume(folder.image, folder.image_selection);
    const AffineTransform to_index = image.index_to_scene.inverse();
    // Segments are drawn on the image's voxels: their borders may lie half a voxel further out.
    constexpr double kBorder = 1.0;
    for (const LabelExtent& extent : label_extents(labels))
        for (const Vec3& corner : {extent.bounds.lower, extent.bounds.upper}) {
            // The box of an oblique label is larger than the label: its middle is what has to lie
            // within.
            const Vec3 index = to_index.point(0.5 * (corner + extent.bounds.center()));
            for (int axis = 0; axis < 3; ++axis)
                if (index[axis] < -kBorder ||
                    index[axis] > image.size[static_cast<std::size_t>(axis)] - 1 + kBorder)
                    return std::nullopt;
        }
    return image;
}

} // namespace palpate
