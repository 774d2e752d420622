// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/geometry/triangle_mesh.h>
#include <palpate/volume/fields/internal/grid_nodes.h>

namespace palpate::internal {

/// Moves vertices, given in the scene, onto the trilinear level by Newton steps along the slope; at
/// most one voxel in all, and a vertex that does not get there stays where it was. [setup]
void project_onto_level(TriangleMesh& mesh, const GridNodes& nodes, double level);

/// Median length of the slope in the middle of the cells that the level passes; 0 when there is
/// none.           [setup]
double median_slope(const GridNodes& nodes, double level);

} // namespace palpate::internal
