// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <palpate/geometry/triangle_mesh.h>

namespace palpate {

/// One part of a mesh whose triangles hang together by shared vertices.
struct MeshComponent {
    std::size_t triangles = 0; ///< > 0
    double area_m2 = 0.0;      ///< m2, >= 0
    double volume_m3 = 0.0;    ///< signed: > 0 when the normals point outwards
    bool closed = false;       ///< every edge runs as often one way as the other: the volume counts
    Box bounds;                ///< of its vertices, m
    Vec3 sample{0.0};          ///< a vertex of the component, to find it again
};

/// What a mesh is worth as a surface to touch. Edges are those of triangles of three different
/// vertices.
struct MeshReport {
    std::size_t vertices = 0;   ///< as the mesh has them, unused ones too
    std::size_t triangles = 0;  ///< as the mesh has them, degenerate ones too
    std::size_t degenerate = 0; ///< |cross product| <= 1e-9 times the longest edge squared
    std::size_t collapsed = 0;  ///< with fewer than three different vertices: they have no edges
    std::size_t duplicates = 0; ///< triangles with the three vertices of an earlier one, either way
    std::size_t unused_vertices = 0;     ///< of no triangle
    std::size_t coincident_vertices = 0; ///< used ones at exactly the position of an earlier one
    std::size_t border_edges = 0;        ///< of one triangle alone
    std::size_t non_manifold_edges = 0; ///< more than two triangles, or two with the same direction
    std::size_t non_manifold_vertices = 0; ///< triangles around the vertex form more than one fan
    /// Closed components that are turned the wrong way: on one side of them the winding number is
    /// negative. A void within a body faces inwards rightly; a lone shell that does is inside out.
    std::size_t inside_out = 0;
    double smallest_angle_deg = 0.0;       ///< 0 for an empty mesh
    double area_m2 = 0.0;                  ///< of all triangles, m2
    double volume_m3 = 0.0;                ///< signed, meaningful when closed
    Box bounds;                            ///< of the used vertices, m
    std::vector<MeshComponent> components; ///< largest area first

    /// There is something, and it has no border.                                        [any]
    bool closed() const noexcept { return triangles > collapsed && border_edges == 0; }
    /// Whether every place of it is one of a surface.                                       [any]
    bool manifold() const noexcept { return non_manifold_edges == 0 && non_manifold_vertices == 0; }
};

/// Counts, angles, orientation and components of a mesh.                                [setup]
/// Throws std::invalid_argument when a triangle names a vertex that does not exist.
MeshReport inspect(const TriangleMesh& mesh);

/// What each defect means when the mesh is touched with contact `mesh`, a sentence each; one
/// sentence when there is none.                                                         [setup]
/// `self_intersections` as count_self_intersections() found them; nothing: not looked for, which is
/// said.
std::vector<std::string> meaning_for_contact(const MeshReport& report,
                                             std::optional<std::size_t> self_intersections);

} // namespace palpate
