// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <palpate/geometry/vec.h>

#include "tests/support/dicom_writer.h"

/// DICOM segmentations and structure sets written by hand.
namespace palpate::test {

/// A segment: its name and where it is, in voxels of the grid.
struct WrittenSegment {
    std::string name;
    std::function<bool(int, int, int)> is_inside; ///< of voxel i, j, k
    std::array<unsigned, 3> lab{32768, 32896, 32896};
};

/// How segments are written.
struct SegmentationForm {
    enum class Type { binary, fractional, label_map };
    Type type = Type::binary;
    bool keeps_empty_frames = false; ///< else frames without a voxel are left out
    bool backwards = false;          ///< frames from the last to the first
    double stated_step = 0.0;        ///< mm between slices; 0: not stated
    double thickness = 0.0;          ///< mm; 0: not stated
    unsigned greatest_share = 200;   ///< of a fractional one
};

/// A segmentation of a grid whose third axis is perpendicular to the others or leans. Fractional
/// ones have the greatest share inside, and less than half of it elsewhere.
DicomDataSet dicom_segmentation(const std::array<int, 3>& size, const AffineTransform& frame,
                                const std::vector<WrittenSegment>& segments,
                                const SegmentationForm& form = {});

/// A structure of a structure set.
struct WrittenStructure {
    int number = 1;
    std::string name;
    std::vector<std::vector<Vec3>> contours; ///< corners, LPS, mm
    std::string type = "CLOSED_PLANAR";
    std::string color = "255\\128\\0";
};

/// A structure set that was drawn on the series with that instance UID.
DicomDataSet dicom_structures(const std::vector<WrittenStructure>& structures,
                              const std::string& series_uid = DicomSeriesOptions{}.series_uid);

} // namespace palpate::test
