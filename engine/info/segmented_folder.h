// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

#include <palpate/engine/info/data_file.h>
#include <palpate/volume/volume_settings.h>

namespace palpate {

/// A segmentation and the image beside it that it was made from, as 3D Slicer saves them, or as
/// they come from an archive.
struct SegmentedFolder {
    std::filesystem::path labels;    ///< .seg.nrrd, DICOM segmentation or structure set
    std::filesystem::path image;     ///< a volume file, or the folder itself; empty: none fits
    VolumeSelection image_selection; ///< which series of the folder
};

/// Looks for one in a folder (not its sub-folders): the file that says itself that it holds labels,
/// and the first image by name, DICOM first.                                             [setup]
/// Nothing where no file holds labels. Throws std::runtime_error "FOLDER: what is wrong; what to
/// do" where several do.
std::optional<SegmentedFolder> find_segmentation(const std::filesystem::path& folder);

/// The image of a segmented folder, where it encloses the labels; else nothing: it is of something
/// else. [setup] Throws as read_volume().
std::optional<VoxelVolume> image_around(const SegmentedFolder& folder, const LabelVolume& labels);

} // namespace palpate
