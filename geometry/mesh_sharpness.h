// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/geometry/triangle_mesh.h>

namespace palpate {

/// Share of the edges between two triangles, neither degenerate, across which the normal turns by
/// more than `angle_deg`: what is felt as stairs on a surface that should be smooth. 0..1; 0
/// without such edges.   [setup] Throws std::invalid_argument when a triangle names a vertex that
/// does not exist.
double share_of_sharp_edges(const TriangleMesh& mesh, double angle_deg);

} // namespace palpate
