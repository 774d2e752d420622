// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <palpate/geometry/formats/internal/mesh_formats.h>

/// What VTK's two formats of polygonal data have in common.
namespace palpate::internal {

/// A type of numbers in a VTK file.
struct VtkType {
    enum class Kind { whole, natural, real }; ///< signed, unsigned, floating-point
    Kind kind = Kind::real;
    std::size_t bytes = 4; ///< 1, 2, 4 or 8; of real ones 4 or 8
};

/// "float", "vtktypeint64" (legacy), "Float32", "UInt8" (XML); nothing for a type of no numbers,
/// or one that is unknown.                                                               [any]
std::optional<VtkType> vtk_type_named(std::string_view name);

enum class ByteOrder { little, big };

/// All numbers of these bytes.                                                           [setup]
std::vector<double> vtk_numbers(std::string_view bytes, VtkType type, ByteOrder order);

/// Cells of polygonal data that are surfaces.
enum class VtkCells {
    polygons, ///< each is cut into a fan, which is right for convex ones
    strips    ///< of triangles: corner k with the two before it, every second one turned round
};

/// Where the cells of one piece of a file belong: the mesh, and the piece's vertices in it.
struct VtkPiece {
    FileMesh& file;
    std::size_t first_vertex = 0;
};

/// Adds `coordinates`, three a vertex, to the mesh.  Throws as MeshSource::fail(): a position that
/// is not finite. [setup]
void add_vtk_vertices(const MeshSource& source, std::span<const double> coordinates,
                      FileMesh& file);

/// Adds cells whose corners are those of `corners` up to their `ends`, each after the other's.
/// [setup] Throws as MeshSource::fail(): ends that do not rise or are not there, a corner that is
/// no vertex of the piece.
void add_vtk_cells(const MeshSource& source, VtkCells kind, std::span<const double> corners,
                   std::span<const double> ends, const VtkPiece& piece);

} // namespace palpate::internal
