// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <palpate/geometry/triangle_mesh.h>

namespace palpate::internal {

/// A point of a way on a mesh.
struct LoopPoint {
    Vec3 point{0.0};  ///< m; on an edge of the mesh
    Vec3 normal{0.0}; ///< unit, as the mesh is oriented; of the vertices about it
};

/// A way on a mesh at one distance from where the mesh was begun.
struct SurfaceLoop {
    std::vector<LoopPoint> points; ///< the last one is not the first one again
    bool is_closed = true;         ///< false: from border to border
    std::size_t component = 0;     ///< of the mesh, the largest one first
    int level = 0;                 ///< from 0; loops of neighbouring levels are a spacing apart
};

/// Loops that cover a mesh evenly: the lines of equal distance, over the surface, from one of its
/// tips, `spacing_m` apart or a little less; no point of the surface is farther than half of that
/// from one, as the mesh measures distances. Each component by itself, the smallest has one. The
/// same mesh gives the same loops.                                                      [setup]
std::vector<SurfaceLoop> surface_loops(const TriangleMesh& mesh, double spacing_m);

/// Distance over a mesh from a vertex to each vertex, m; infinite where no way leads: fast marching
/// over triangles (Kimmel and Sethian 1998), each with the source unfolded into its plane. What
/// surface_loops() goes by, for tests. `triangles` name the vertices that exist.        [setup]
std::vector<double> surface_distances(const TriangleMesh& mesh, std::size_t from);

} // namespace palpate::internal
