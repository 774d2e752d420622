// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <palpate/geometry/vec.h>
#include <palpate/volume/label_volume.h>

namespace palpate {

/// A label as slices show it.
struct SliceLabel {
    std::string name;   ///< as the volume has it
    std::string color;  ///< sRGB, "#rrggbb": the segmentation's, or one that tells it from others
    int structure = -1; ///< index into ViewDocument::structures of what is felt of it; -1: nothing
};

/// A label volume as slices on a screen show it: 16 bits a voxel, coarser where it is large.
struct LabelSlices {
    std::string name;                  ///< of the volume in the scene
    std::array<int, 3> shape{0, 0, 0}; ///< voxels along i, j, k
    AffineTransform index_to_scene;    ///< of these voxels: index -> scene, m
    std::vector<std::uint16_t> values; ///< i fastest; 0: no label, n: labels[n - 1]
    std::vector<SliceLabel> labels;    ///< as LabelVolume::labels counts, at most 65,535
};

/// A colour for the n-th of many: hues that stay apart, each a golden angle on from the one before,
/// of a middle lightness (the HSL colour of saturation 0.45 and lightness 0.6). "#rrggbb" [any]
std::string made_up_color(std::size_t place);

/// What covers most of each block of voxels, so that no edge has more than `most_edge` of them, 1
/// or more; of two that cover as much, the one that comes later in the list. Where segments overlap
/// the one of the last layer counts.                                                       [setup]
LabelSlices label_slices(std::string name, const LabelVolume& volume, int most_edge = 128);

} // namespace palpate
