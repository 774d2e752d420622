// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include <palpate/geometry/triangle_mesh.h>

namespace palpate {

/// Refuses a mesh that nothing can be made of: no triangle, an index that no vertex has, a vertex
/// that is not finite, a size or place that no patient has (implausible_bounds()). What a mesh file
/// is refused for, it is refused for, too.                                              [setup]
/// Throws std::invalid_argument that begins with `what`: "surfaces[\"bone\"].triangle_mesh".
void require_mesh(std::string_view what, const TriangleMesh& mesh);

} // namespace palpate
