// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <palpate/geometry/vec.h>

namespace palpate {

/// A triangle mesh: positions in metres, scene frame; a triangle is counter-clockwise seen from
/// free space.
struct TriangleMesh {
    std::vector<Vec3> vertices;                          ///< m, scene frame
    std::vector<std::array<std::uint32_t, 3>> triangles; ///< three indices into `vertices` each
};

/// True when |cross product| <= 1e-9 times the longest edge squared: no normal worth the name.
/// [any]
bool is_degenerate(const Vec3& a, const Vec3& b, const Vec3& c) noexcept;

/// Unit normal of a triangle by the right-hand rule; zero for a degenerate one.         [any]
Vec3 triangle_normal(const Vec3& a, const Vec3& b, const Vec3& c) noexcept;

/// The point of triangle abc that is closest to p, in double (Ericson, Real-Time Collision
/// Detection, 5.1.5).  [any]
Vec3 closest_point_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) noexcept;

} // namespace palpate
