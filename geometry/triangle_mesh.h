// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <palpate/geometry/vec.h>

namespace palpate {

/// A triangle mesh: positions in metres, scene frame; a triangle is counter-clockwise seen from
/// free space.
struct TriangleMesh {
    std::vector<Vec3> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// One part of a mesh whose triangles hang together by shared vertices.
struct MeshComponent {
    std::size_t triangles = 0;
    double area_m2 = 0.0;
    double volume_m3 = 0.0; ///< signed: > 0 when the normals point outwards
    Box bounds;
    Vec3 sample{0.0}; ///< a vertex of the component, to find it again
};

/// What a mesh is worth as a surface to touch.
struct MeshReport {
    std::size_t vertices = 0;
    std::size_t triangles = 0;
    std::size_t degenerate = 0; ///< |cross product| <= 1e-9 times the longest edge squared
    std::size_t border_edges = 0;
    std::size_t non_manifold_edges = 0; ///< more than two triangles, or two with the same direction
    std::size_t non_manifold_vertices = 0; ///< triangles around the vertex form more than one fan
    double smallest_angle_deg = 0.0;       ///< 0 for an empty mesh
    double area_m2 = 0.0;
    double volume_m3 = 0.0; ///< signed, meaningful when closed
    Box bounds;
    std::vector<MeshComponent> components; ///< largest area first

    bool closed() const noexcept { return triangles > 0 && border_edges == 0; }
    bool manifold() const noexcept { return non_manifold_edges == 0 && non_manifold_vertices == 0; }
};

/// Counts, angles, orientation and components of a mesh.                                [setup]
/// Throws std::invalid_argument when a triangle names a vertex that does not exist.
MeshReport inspect(const TriangleMesh& mesh);

/// True when |cross product| <= 1e-9 times the longest edge squared: no normal worth the name.
/// [any]
bool is_degenerate(const Vec3& a, const Vec3& b, const Vec3& c) noexcept;

/// Unit normal of a triangle by the right-hand rule; zero for a degenerate one.         [any]
Vec3 triangle_normal(const Vec3& a, const Vec3& b, const Vec3& c) noexcept;

/// The point of triangle abc that is closest to p, in double (Ericson, Real-Time Collision
/// Detection, 5.1.5).  [any]
Vec3 closest_point_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) noexcept;

} // namespace palpate
