// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <palpate/volume/formats/internal/dicom_image.h>

namespace palpate::internal {

/// Where a frame of a segmentation lies. Frames without a voxel are left out of such files, so
/// slices may be far apart.
struct SegmentFrame {
    std::int32_t segment = 0; ///< its number; 0 where a frame shows all segments
    Vec3 position{0.0};       ///< centre of the first pixel, LPS, mm
    Vec3 along_row{1.0, 0, 0};
    Vec3 along_column{0, 1.0, 0};
    double column_spacing = 1.0; ///< mm
    double row_spacing = 1.0;    ///< mm
    double stated_step = 0.0;    ///< mm from slice to slice; 0: not stated
    double thickness = 0.0;      ///< mm of a slice; 0: not stated
};

/// A frame, from what was read of its place and from its pixel measures.                 [any]
SegmentFrame frame_of(const DicomFrameAttributes& attributes, const DicomImage& image);

/// The grid that the frames of a segmentation lie on.
struct SegmentGrid {
    std::array<int, 3> size{0, 0, 0};
    AffineTransform index_to_scene;
    std::vector<std::size_t> slices; ///< of each frame, in their order
    std::vector<std::string> warnings;
};

/// Finds the grid: the stated step where the frames lie on its multiples, else the smallest
/// distance of two of them. `image` is one of them.                                     [setup]
/// Throws import_error: frames that are turned, shifted or sized differently; not evenly spaced; of
/// one slice whose thickness is not known; two frames of one segment in one slice.
SegmentGrid segment_grid(const std::filesystem::path& file, const std::vector<SegmentFrame>& frames,
                         const DicomImage& image);

} // namespace palpate::internal
