// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <palpate/geometry/vec.h>
#include <palpate/volume/voxel_volume.h>

namespace palpate {

/// A volume as slices on a screen show it: 8 bits a voxel, coarser where it is large.
struct SliceVoxels {
    std::string name;                       ///< of the volume in the scene
    std::array<int, 3> shape{0, 0, 0};      ///< voxels along i, j, k
    AffineTransform index_to_scene;         ///< of these voxels: index -> scene, m
    std::vector<std::uint8_t> values;       ///< i fastest
    double low = 0.0;                       ///< what 0 stands for, the volume's own unit
    double high = 1.0;                      ///< what 255 stands for; > low
    std::array<double, 2> window{0.0, 1.0}; ///< what a slice shows at first, black and white
};

/// Means of blocks of voxels, so that no edge has more than `most_edge` of them, 1 or more; values
/// that are not finite do not count. 0 and 255 stand for the 0.1st and the 99.9th percentile of
/// what is left; the window for the 1st and the 99th.                                     [setup]
SliceVoxels slice_voxels(std::string name, const VoxelVolume& volume, int most_edge = 128);

} // namespace palpate
