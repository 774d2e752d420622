// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>

#include <palpate/volume/formats/internal/label_names.h>
#include <palpate/volume/label_volume.h>
#include <palpate/volume/volume_settings.h>

/// DICOM objects that name structures: segmentations (PS3.3 A.51) and structure sets of radiation
/// therapy (A.19).
namespace palpate::internal {

enum class DicomLabels {
    none,
    segmentation, ///< SEG: a bit, a share or a number for each voxel
    structure_set ///< RT-STRUCT: contours
};

/// What a storage class holds.                                                            [any]
DicomLabels dicom_labels_of_class(std::string_view storage_class) noexcept;

/// What a file holds; none also for a folder, or what is no DICOM. Reads its first bytes. [setup]
DicomLabels dicom_labels_of(const std::filesystem::path& file);

/// A segmentation: the voxels of each segment, its name, its colour. Segments that overlap lie in
/// layers. Of a fractional one the voxels with at least half of its greatest share count. Slices
/// that no frame shows are empty.                                                       [setup]
/// Throws import_error: damaged, without a place in the patient, frames that are not on one evenly
/// spaced grid, a frame of a segment that is not described.
LabelVolume read_dicom_segmentation(const std::filesystem::path& file, const LabelNames& names);

/// A structure set on the grid of `selection.reference`, which is read with the rest of
/// `selection`; of a DICOM folder the series that the structure set was drawn on is taken, unless
/// another one is asked for. ContourMask says which voxels are inside.                  [setup]
/// Throws import_error: damaged; no reference; no contour on its grid. Throws as read_volume().
LabelVolume read_dicom_structures(const std::filesystem::path& file, const LabelNames& names,
                                  const VolumeSelection& selection);

} // namespace palpate::internal
