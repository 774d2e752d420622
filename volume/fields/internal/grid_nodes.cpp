// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/fields/internal/grid_nodes.h>

namespace palpate::internal {

namespace {

/// Where four nodes in a row along one axis lie: part of the table's index and part of the offset
/// in a leaf.
struct Row {
    std::array<std::ptrdiff_t, 4> leaf;
    std::array<int, 4> offset;
};

Row row_of(int first, std::ptrdiff_t stride, int shift) noexcept {
    Row row;
    for (int n = 0; n < 4; ++n) {
        const auto slot = static_cast<std::size_t>(n);
        row.leaf[slot] = ((first + n) >> 3) * stride;
        row.offset[slot] = ((first + n) & (GridNodes::kLeafEdge - 1)) << shift;
    }
    return row;
}

} // namespace

void GridNodes::gather(const CellIndex& index, Cell& cell) const noexcept {
    const Row row_i = row_of(index.i - 1, stride[0], 6);
    const Row row_j = row_of(index.j - 1, stride[1], 3);
    const Row row_k = row_of(index.k - 1, stride[2], 0);
    const auto node = [&](std::size_t a, std::size_t b, std::size_t c) -> double {
        const float* leaf =
            leaves[static_cast<std::size_t>(row_i.leaf[a] + row_j.leaf[b] + row_k.leaf[c])];
        return leaf[row_i.offset[a] + row_j.offset[b] + row_k.offset[c]];
    };
    // Four nodes in a row give two corners and their central differences along it: 3 x 4 rows.
    for (std::size_t n = 0; n < 4; ++n) {
        const std::size_t u = n & 1, w = n >> 1;
        const std::array<double, 4> i{node(0, 1 + u, 1 + w), node(1, 1 + u, 1 + w),
                                      node(2, 1 + u, 1 + w), node(3, 1 + u, 1 + w)};
        const std::array<double, 4> j{node(1 + u, 0, 1 + w), node(1 + u, 1, 1 + w),
                                      node(1 + u, 2, 1 + w), node(1 + u, 3, 1 + w)};
        const std::array<double, 4> k{node(1 + u, 1 + w, 0), node(1 + u, 1 + w, 1),
                                      node(1 + u, 1 + w, 2), node(1 + u, 1 + w, 3)};
        for (std::size_t e = 0; e < 2; ++e) {
            auto& by_i = cell.corner[e + 2 * u + 4 * w].v;
            by_i[0] = i[e + 1];
            by_i[1] = 0.5 * (i[e + 2] - i[e]);
            cell.corner[u + 2 * e + 4 * w].v[2] = 0.5 * (j[e + 2] - j[e]);
            cell.corner[u + 2 * w + 4 * e].v[3] = 0.5 * (k[e + 2] - k[e]);
        }
    }
}

bool GridNodes::is_missing(const CellIndex& cell) const noexcept {
    if (missing.empty()) return false; // a cell with data has a node of the volume
    for (int corner = 0; corner < 8; ++corner) {
        const int i = cell.i + (corner & 1) - kOrigin;
        const int j = cell.j + (corner >> 1 & 1) - kOrigin;
        const int k = cell.k + (corner >> 2) - kOrigin;
        if (i < 0 || j < 0 || k < 0 || i >= size[0] || j >= size[1] || k >= size[2]) continue;
        const std::size_t bit =
            static_cast<std::size_t>(i) +
            static_cast<std::size_t>(size[0]) *
                (static_cast<std::size_t>(j) +
                 static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(k));
        if ((missing[bit / 64] >> (bit % 64) & 1) == 0) return false;
    }
    return true;
}

} // namespace palpate::internal
