// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/component_image.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include <palpate/geometry/internal/ordinary_file.h>
#include <palpate/volume/formats/internal/volume_import.h>
#include <palpate/volume/formats/volume_file.h>

namespace palpate::internal {

Mat3 nearest_rotation(const Mat3& matrix) {
    // Newton's iteration for the polar factor: quadratic, and convergent for every regular matrix.
    constexpr int kMostSteps = 50;
    constexpr double kSettled = 1e-15; // rounding of entries up to 1
    double longest = 0.0;
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row)
            longest = std::max(longest, std::abs(matrix[column][row]));
    const bool is_about_one = longest > 0.25 && longest < 2.0; // the steps do the rest
    Mat3 rotation = is_about_one ? matrix : matrix / longest;
    for (int step = 0; step < kMostSteps; ++step) {
        const Mat3 next = 0.5 * (rotation + glm::transpose(glm::inverse(rotation)));
        double change = 0.0;
        for (int column = 0; column < 3; ++column)
            change = std::max(change, glm::length(next[column] - rotation[column]));
        rotation = next;
        if (change < kSettled) break;
    }
    return rotation;
}

Mat3 image_axes(const AffineTransform& index_to_scene) {
    Mat3 axes = index_to_scene.linear;
    for (int axis = 0; axis < 3; ++axis)
        axes[axis] = glm::normalize(axes[axis]);
    // Handedness is the same in RAS and LPS: two axes are reversed.
    if (glm::determinant(axes) > 0.0) axes[0] = -axes[0];
    return nearest_rotation(axes);
}

std::optional<ComponentImage> read_component_image(const std::filesystem::path& file,
                                                   VolumeSelection::NiftiTransform transform,
                                                   ImagePart part) {
    refuse_pipe_or_device(file);
    const std::string name = file.filename().string();
    if (name.ends_with(".nrrd") || name.ends_with(".nhdr")) return read_nrrd_image(file, part);
    if (name.ends_with(".nii") || name.ends_with(".nii.gz"))
        return read_nifti_image(file, transform, part);
    if (name.ends_with(".mha") || name.ends_with(".mhd")) return read_meta_image(file, part);
    return std::nullopt;
}

void require_scalar(const std::filesystem::path& file, const ComponentImage& image) {
    if (image.components == 1) return;
    const std::string count = std::to_string(image.components);
    if (image.kind == "time")
        throw import_error(file,
                           "has 4 dimensions, " + count +
                               " volumes, as of a time series; extract one of them (with FSL: "
                               "fslroi IN OUT 0 1)");
    if (image.kind == "list")
        throw import_error(file, "has " + count +
                                     " layers per voxel, as a segmentation with overlaps; name a "
                                     "label of it, or save one layer");
    throw import_error(file, "has " + count + " numbers per voxel" +
                                 (image.kind.empty() ? "" : " (" + short_text(image.kind) + ")") +
                                 " and is no scalar volume; use it as vectors, or save one number "
                                 "of each voxel");
}

VoxelVolume as_scalar_volume(const std::filesystem::path& file, ComponentImage&& image) {
    require_scalar(file, image);
    VoxelVolume volume;
    volume.size = image.size;
    volume.values = std::move(image.values);
    volume.index_to_scene = image.index_to_scene;
    volume.source_type = std::move(image.source_type);
    volume.warnings = std::move(image.warnings);
    return volume;
}

} // namespace palpate::internal
