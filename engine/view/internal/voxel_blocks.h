// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include <palpate/geometry/vec.h>

namespace palpate::internal {

/// Cubes of voxels, so that a volume has few enough of them along each edge; the last ones are cut
/// off where they do not fit.
struct VoxelBlocks {
    std::array<int, 3> size;  ///< voxels of the volume along i, j, k
    std::array<int, 3> edge;  ///< voxels of a block
    std::array<int, 3> count; ///< blocks

    /// Blocks, all together.
    std::size_t all() const noexcept {
        return static_cast<std::size_t>(count[0]) * static_cast<std::size_t>(count[1]) *
               static_cast<std::size_t>(count[2]);
    }

    /// Calls visit(first, end) for each block, i fastest, with the indices of its voxels.
    template <class Visit>
    void for_each(const Visit& visit) const {
        for (int k = 0; k < size[2]; k += edge[2])
            for (int j = 0; j < size[1]; j += edge[1])
                for (int i = 0; i < size[0]; i += edge[0])
                    visit(std::array{i, j, k},
                          std::array{std::min(i + edge[0], size[0]), std::min(j + edge[1], size[1]),
                                     std::min(k + edge[2], size[2])});
    }

    /// Index of a block -> scene, m, from the same of voxels: the middle of a whole block.
    AffineTransform index_to_scene(const AffineTransform& of_voxels) const {
        const Vec3 voxels(edge[0], edge[1], edge[2]);
        AffineTransform of_blocks = of_voxels;
        for (int axis = 0; axis < 3; ++axis)
            of_blocks.linear[axis] *= voxels[axis];
        of_blocks.offset = of_voxels.point(0.5 * (voxels - Vec3(1.0)));
        return of_blocks;
    }
};

/// Blocks of which no edge has more than `most_edge`, 1 or more.                           [setup]
inline VoxelBlocks voxel_blocks(const std::array<int, 3>& size, int most_edge) {
    VoxelBlocks blocks{size, {}, {}};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        blocks.edge[axis] = std::max(1, (size[axis] + most_edge - 1) / most_edge);
        blocks.count[axis] = (size[axis] + blocks.edge[axis] - 1) / blocks.edge[axis];
    }
    return blocks;
}

} // namespace palpate::internal
