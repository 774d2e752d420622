// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include <palpate/geometry/vec.h>
#include <palpate/volume/voxel_numbers.h>

namespace palpate {

/// A dense scalar image as it was scanned: values at voxel centres, i fastest.
struct VoxelVolume {
    std::array<int, 3> size{0, 0, 0}; ///< voxels along i, j, k
    VoxelNumbers<float> values;     ///< own unit (HU ...); values[i + size[0] * (j + size[1] * k)]
    AffineTransform index_to_scene; ///< voxel index (i,j,k) -> scene point (LPS, m); columns are
                                    ///< direction * spacing
    std::string source_type;        ///< voxel type of the file, as "int16", "float32"
    std::vector<std::string> warnings; ///< what a user should know of how the file was read

    /// Voxels in all: as many as `values` has to have.                                      [any]
    std::size_t voxels() const noexcept {
        return static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
               static_cast<std::size_t>(size[2]);
    }
    /// Where voxel (i, j, k) is in `values`; each index in [0, size).                       [any]
    std::size_t index(int i, int j, int k) const noexcept {
        return static_cast<std::size_t>(i) +
               static_cast<std::size_t>(size[0]) *
                   (static_cast<std::size_t>(j) +
                    static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(k));
    }
    /// The value of a voxel; ranges as of index().                                       [any]
    float at(int i, int j, int k) const noexcept { return values[index(i, j, k)]; }
    /// Distance between neighbours along i, j, k, m.                                        [any]
    Vec3 spacing_m() const noexcept {
        return {glm::length(index_to_scene.linear[0]), glm::length(index_to_scene.linear[1]),
                glm::length(index_to_scene.linear[2])};
    }
};

/// Smallest and largest finite value; {0,0} when there is none.                         [any]
std::array<double, 2> value_range(const VoxelVolume& volume) noexcept;

/// Orientation in words: where voxel 0,0,0 lies and where each index runs, as
/// "voxel 0,0,0 lies right, anterior, inferior; i runs to the patient's left, j posterior, k
/// superior"; oblique axes say by how many degrees they are off. [any]
std::string orientation_in_words(const VoxelVolume& volume);

} // namespace palpate
