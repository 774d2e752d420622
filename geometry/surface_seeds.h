// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <palpate/geometry/mesh_report.h>
#include <palpate/geometry/triangle_mesh.h>

namespace palpate {

/// Seeds for extract_isosurface() from a preview of the same surface (any closed mesh of it,
/// however bad its triangles).
///
/// They decide which components exist in the result, so every component of at least
/// `smallest_component_triangles` gets them: its vertices, thinned to one per cube of 1.1 facet
/// sizes and side of the surface (a sheet thinner than a cube keeps both faces), and at least 40,
/// or all it has. In the preview's order of components; deterministic.      [setup] Throws
/// std::invalid_argument when facet_size_m is not > 0 and finite, or a triangle names a vertex that
/// does not exist.
std::vector<Vec3> choose_seeds(const TriangleMesh& preview, double facet_size_m,
                               std::size_t smallest_component_triangles);

/// How much of one component of a preview a mesh has.
struct ComponentMatch {
    MeshComponent component; ///< of the preview
    double covered = 0.0;    ///< share of its vertices with a triangle of the mesh near them that
                             ///< faces the same way, 0..1
};

/// The components of the preview, of at least `smallest_component_triangles`, that have no
/// counterpart in the mesh: less than half of their vertices have a triangle within `tolerance_m`
/// (or a quarter of the component's smallest extent, if that is less) that faces within 90 degrees
/// of the preview there. The other wall of a thin sheet is thus no counterpart. Largest area first.
/// With the arguments exchanged: what the mesh has and the preview does not.          [setup]
/// Throws std::invalid_argument when tolerance_m is not > 0 and finite, or a triangle names a
/// vertex that does not exist.
std::vector<ComponentMatch> missing_components(const TriangleMesh& preview,
                                               const TriangleMesh& mesh,
                                               std::size_t smallest_component_triangles,
                                               double tolerance_m);

} // namespace palpate
