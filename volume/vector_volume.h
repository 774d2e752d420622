// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include <palpate/volume/voxel_volume.h>

namespace palpate {

/// A dense image of vectors or symmetric tensors, turned into the scene frame.
struct VectorVolume {
    /// What a voxel holds; decides `components`.
    enum class Kind {
        vector,          ///< as a velocity, or a direction of fibres
        symmetric_tensor ///< as a diffusion
    };
    Kind kind = Kind::vector;         ///< what a voxel holds
    std::array<int, 3> size{0, 0, 0}; ///< voxels along i, j, k, each > 0
    int components = 3; ///< vector: 3 (x, y, z); symmetric_tensor: 6 (xx, xy, xz, yy, yz, zz)
    VoxelNumbers<float> values;     ///< own unit; component fastest, then i; LPS axes
    AffineTransform index_to_scene; ///< as VoxelVolume's
    std::string source_type;        ///< voxel type of the file
    std::string frame; ///< in words: the axes the file's components were in, and who says so
    std::vector<std::string> warnings; ///< what a user should know of how the file was read

    /// Voxels, not numbers: each has `components` of them.                                  [any]
    std::size_t voxels() const noexcept {
        return static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
               static_cast<std::size_t>(size[2]);
    }
};

} // namespace palpate
