// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <palpate/geometry/vec.h>
#include <palpate/volume/fields/internal/cell.h>

namespace palpate::internal {

/// What a loop reads of an OpenVDB grid: its leaf buffers in a flat table, so that a node costs two
/// loads instead of a walk down the tree, and nothing registers with the tree. The grid owns the
/// buffers; constant tiles share one buffer a value.
///
/// "Local" coordinates are node indices + kOrigin: never negative where there are nodes, and
/// aligned with the leaves. The volume's nodes 0 .. size-1 are surrounded by two layers of
/// background, which the stencil of central differences needs.
struct GridNodes {
    static constexpr int kOrigin = 8;   ///< one leaf, so that node -2 has a local coordinate >= 0
    static constexpr int kPadding = 2;  ///< nodes of background on each side
    static constexpr int kLeafEdge = 8; ///< nodes along an edge of a leaf

    std::array<int, 3> size{0, 0, 0}; ///< nodes of the volume, without padding
    double background = 0.0;          ///< U
    AffineTransform index_to_scene;   ///< node index -> m
    AffineTransform scene_to_local;   ///< m -> local coordinates
    Mat3 gradient_to_scene{1.0};      ///< derivatives by index -> derivatives by metre
    std::vector<const float*> leaves; ///< 512 values each, i slowest, as OpenVDB lays them out
    std::array<std::ptrdiff_t, 3> stride{}; ///< of `leaves`, along i, j, k
    std::vector<std::uint64_t>
        missing; ///< a bit per node of the volume, i fastest; empty when none is missing

    /// Cells with a node of the volume have data: local coordinates first_cell() <= x <
    /// end_cell(axis).   [any]
    static constexpr int first_cell() noexcept { return kOrigin - 1; }
    int end_cell(int axis) const noexcept { return kOrigin + size[static_cast<std::size_t>(axis)]; }

    /// Whether a local point lies in a cell that has a node of the volume; false for NaN.  [loop]
    bool inside(const Vec3& local) const noexcept {
        constexpr double first = first_cell();
        return local.x >= first && local.y >= first && local.z >= first && local.x < end_cell(0) &&
               local.y < end_cell(1) && local.z < end_cell(2);
    }

    /// The cell of a local point that is inside().                                       [loop]
    static CellIndex cell_of(const Vec3& local) noexcept {
        return {static_cast<int>(local.x), static_cast<int>(local.y), static_cast<int>(local.z)};
    }

    /// The eight corners of a cell with data, i fastest.                                 [loop]
    Corners corners(const CellIndex& cell) const noexcept;

    /// A cell with data: corners and central differences, from 32 nodes.                 [loop]
    void gather(const CellIndex& index, Cell& cell) const noexcept;

    /// True when every corner of the cell is padding or a replaced voxel.                [loop]
    bool is_missing(const CellIndex& cell) const noexcept;
};

inline Corners GridNodes::corners(const CellIndex& c) const noexcept {
    constexpr int kLast = kLeafEdge - 1;
    const std::ptrdiff_t leaf =
        (c.i >> 3) * stride[0] + (c.j >> 3) * stride[1] + (c.k >> 3) * stride[2];
    const int i = c.i & kLast;
    const int j = c.j & kLast;
    const int k = c.k & kLast;
    Corners v;
    if (i < kLast && j < kLast && k < kLast) { // one leaf holds them all: two thirds of the cells
        const float* p = leaves[static_cast<std::size_t>(leaf)] + (i << 6 | j << 3 | k);
        v = {p[0], p[64], p[8], p[72], p[1], p[65], p[9], p[73]};
        return v;
    }
    const std::array<std::ptrdiff_t, 2> leaf_i{0, i < kLast ? 0 : stride[0]};
    const std::array<std::ptrdiff_t, 2> leaf_j{0, j < kLast ? 0 : stride[1]};
    const std::array<std::ptrdiff_t, 2> leaf_k{0, k < kLast ? 0 : stride[2]};
    const std::array<int, 2> in_i{i << 6, ((i + 1) & kLast) << 6};
    const std::array<int, 2> in_j{j << 3, ((j + 1) & kLast) << 3};
    const std::array<int, 2> in_k{k, (k + 1) & kLast};
    for (unsigned corner = 0; corner < 8; ++corner) {
        const unsigned a = corner & 1, b = corner >> 1 & 1, d = corner >> 2;
        v[corner] = leaves[static_cast<std::size_t>(leaf + leaf_i[a] + leaf_j[b] + leaf_k[d])]
                          [in_i[a] + in_j[b] + in_k[d]];
    }
    return v;
}

} // namespace palpate::internal
