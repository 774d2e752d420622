// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include <palpate/geometry/triangle_mesh.h>

namespace palpate {

namespace internal {

/// A cube of a regular grid about the origin.
struct Cube {
    std::int64_t x, y, z;
    bool operator==(const Cube&) const = default;
};

struct CubeHash {
    std::size_t operator()(const Cube& c) const noexcept {
        // Teschner et al. 2003, Optimized Spatial Hashing: three large primes.
        return static_cast<std::size_t>(static_cast<std::uint64_t>(c.x) * 73856093 ^
                                        static_cast<std::uint64_t>(c.y) * 19349663 ^
                                        static_cast<std::uint64_t>(c.z) * 83492791);
    }
};

inline Cube cube_of(const Vec3& p, double side) noexcept {
    const Vec3 q = glm::floor(p / side);
    return {static_cast<std::int64_t>(q.x), static_cast<std::int64_t>(q.y),
            static_cast<std::int64_t>(q.z)};
}

} // namespace internal

/// The triangles of a mesh by the cubes that their boxes meet. The mesh must outlive it.
class TriangleGrid {
public:
    TriangleGrid(const TriangleMesh& mesh, double side);

    /// True when a triangle that faces within 90 degrees of `direction` comes within `radius`, at
    /// best at most a cube's side, of p.
    bool has_facing(const Vec3& p, const Vec3& direction, double radius) const;

private:
    bool has_facing_among(const std::vector<std::uint32_t>& triangles, const Vec3& p,
                          const Vec3& direction, double radius) const;

    const TriangleMesh& mesh_;
    double side_;
    std::vector<std::uint32_t> large_; // of too many cubes
    std::unordered_map<internal::Cube, std::vector<std::uint32_t>, internal::CubeHash>
        triangles_in_;
};

} // namespace palpate
