// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <palpate/geometry/triangle_mesh.h>

namespace palpate {

/// A mesh of at most so many triangles that looks like `mesh`, for pictures: vertices in one cell
/// of a cubic grid become their mean, triangles that are left without area go. The cells are as
/// small as that allows, to some 10 %. Sheets that are closer than a cell may become one, and a
/// few triangles in a thousand may be turned over. A mesh
/// that is small enough is given back as it is. m, scene frame.                           [setup]
/// Throws std::invalid_argument where `most_triangles` is 0.
TriangleMesh coarse_mesh(const TriangleMesh& mesh, std::size_t most_triangles);

/// The box around a mesh, m; empty of an empty one.                                      [setup]
Box box_of(const TriangleMesh& mesh);

/// A mesh with 16 bits for each coordinate within a box.
struct QuantisedMesh {
    std::vector<std::uint16_t> positions; ///< x, y, z in the box: 0 its lower, 65535 its upper end
    std::vector<std::uint32_t> indices;   ///< three for each triangle
};

/// Rounds to the nearest step: wrong by half of the box's edge / 65535 at most. What is outside of
/// `box` goes to its border.                                                             [setup]
QuantisedMesh quantised(const TriangleMesh& mesh, const Box& box);

} // namespace palpate
