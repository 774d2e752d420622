// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <palpate/geometry/formats/internal/mesh_source.h>
#include <palpate/geometry/triangle_mesh.h>

namespace palpate::internal {

/// "SPACE=LPS" or "UNIT=mm" out of a comment, whatever its value.
struct MeshStatement {
    std::string text;
    std::optional<std::size_t> byte; ///< where it stands; nothing where the file has no lines
};

/// A mesh as its file has it: every coordinate finite, every index that of a vertex.
struct FileMesh {
    TriangleMesh mesh; ///< in the file's frame and unit
    std::vector<MeshStatement> statements;
    std::vector<std::string> warnings;
};

/// Keeps the statements of a comment, as Slicer writes it: "3D Slicer output. SPACE=LPS".
void note_statements(std::string_view comment, std::optional<std::size_t> byte, FileMesh& file);

/// Warns where the text does not end with a line break: its last number may have lost digits.
void note_missing_line_break(const MeshSource& source, FileMesh& file);

/// Throw std::runtime_error "FILE[:LINE]: what is wrong; what to do".                   [setup]
FileMesh read_ply_mesh(MeshSource& source);
FileMesh read_stl_mesh(MeshSource& source);
FileMesh read_obj_mesh(MeshSource& source);
FileMesh read_vtk_mesh(MeshSource& source);
FileMesh read_vtp_mesh(MeshSource& source);

} // namespace palpate::internal
