// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>

#include <palpate/geometry/triangle_mesh.h>

namespace palpate {

/// A way to count self-intersections; how it is handed to those that must not depend on CGAL.
using IntersectionCounter = std::function<std::size_t(const TriangleMesh&)>;

/// Pairs of triangles that have more in common than corners and sides of both: exact predicates,
/// on any triangles, manifold or not. Corners of equal coordinates are one vertex, whatever their
/// indices; degenerate triangles are left out; two triangles of the same three vertices are a pair.
/// [setup] In palpate::extraction (CGAL, GPL). Throws std::invalid_argument when a triangle names a
/// vertex that does not exist or is not finite.
std::size_t count_self_intersections(const TriangleMesh& mesh);

} // namespace palpate
