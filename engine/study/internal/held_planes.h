// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include <palpate/geometry/vec.h>

namespace palpate::internal {

/// Up to three planes that hold a god-object (Zilles and Salisbury, 1995).
class HeldPlanes {
public:
    void clear() noexcept { count_ = 0; }                                  ///< [loop]
    bool is_full() const noexcept { return count_ == 3; }                  ///< [loop]
    void add(const Vec3& normal) noexcept { normals_[count_++] = normal; } ///< unit  [loop]

    /// The point nearest to `probe`, m, that none of the planes through `at` keeps away: on one, on
    /// two or on three of them.                                                          [loop]
    Vec3 goal(const Vec3& at, const Vec3& probe) const noexcept {
        const Vec3 way = probe - at;
        if (count_ == 0) return probe;
        if (count_ == 1) return at + way - glm::dot(way, normals_[0]) * normals_[0];
        if (count_ == 3) return at;
        const Vec3 edge = glm::cross(normals_[0], normals_[1]);
        const double squared = squared_length(edge);
        constexpr double parallel = 1e-12;
        if (squared < parallel) return at + way - glm::dot(way, normals_[1]) * normals_[1];
        return at + (glm::dot(way, edge) / squared) * edge;
    }

private:
    std::array<Vec3, 3> normals_{};
    std::size_t count_ = 0;
};

} // namespace palpate::internal
