// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include <palpate/geometry/triangle_mesh.h>

namespace palpate::internal {

/// Sets that grow together: union-find; the root of a set is its lowest element, whatever the order
/// of the joins.
class DisjointSets {
public:
    explicit DisjointSets(std::size_t count) : parent_(count) {
        std::iota(parent_.begin(), parent_.end(), 0u);
    }
    std::uint32_t root(std::uint32_t element) noexcept {
        while (parent_[element] != element) {
            parent_[element] = parent_[parent_[element]];
            element = parent_[element];
        }
        return element;
    }
    void join(std::uint32_t a, std::uint32_t b) noexcept {
        std::uint32_t low = root(a), high = root(b);
        if (high < low) std::swap(low, high);
        parent_[high] = low;
    }

private:
    std::vector<std::uint32_t> parent_;
};

/// Which component every triangle and vertex belongs to; numbered in the order of their first
/// triangles.
struct ComponentLabels {
    static constexpr std::uint32_t kNone = 0xffffffffu;

    std::size_t count = 0;
    std::vector<std::uint32_t> of_triangle;
    std::vector<std::uint32_t> of_vertex; ///< kNone for a vertex of no triangle
};

/// Components of a mesh by shared vertices; indices must be valid.                      [setup]
ComponentLabels label_components(const TriangleMesh& mesh);

} // namespace palpate::internal
