// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <palpate/geometry/internal/mesh_components.h>
#include <palpate/geometry/triangle_mesh.h>

namespace palpate::internal {

/// For each point, the components that enclose it: those of which a line upwards (z) from it meets
/// an odd number of triangles, in ascending order. Only meaningful for closed components. About
/// linear in triangles and points.                                                      [setup]
/// A point on a component's surface is enclosed or not, as rounding has it.
std::vector<std::vector<std::uint32_t>> enclosing_components(const TriangleMesh& mesh,
                                                             const ComponentLabels& labels,
                                                             const std::vector<Vec3>& points);

} // namespace palpate::internal
