// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <palpate/geometry/mesh_file_settings.h>
#include <palpate/geometry/triangle_mesh.h>

namespace palpate {

/// A mesh as read, and what was taken for granted.
struct MeshFile {
    TriangleMesh mesh;                    ///< scene frame (LPS), m
    MeshFrame frame = MeshFrame::lps;     ///< of the file: lps or ras
    MeshUnit unit = MeshUnit::millimetre; ///< of the file
    bool frame_stated = false;            ///< in the file (SPACE=LPS or SPACE=RAS in a comment)
    bool unit_stated = false;             ///< in the file (UNIT=mm or UNIT=m in a comment)
    /// What was assumed, as "states no frame: LPS is assumed"; where settings contradict the file;
    /// a size that speaks against the unit; bytes that were passed over; text that may be cut off.
    std::vector<std::string> warnings;
};

/// Reads a surface mesh by its ending: PLY (ascii, binary little and big-endian), STL (ascii,
/// binary; corners of equal coordinates become one vertex), OBJ (v and f, positive and negative
/// indices; textures and normals are passed over), VTK's polygonal data (.vtk: ascii and binary, up
/// to version 5.1; .vtp: text, base64, appended raw or base64, deflated by zlib, both byte orders;
/// triangle strips too; lines, points and values are passed over). Polygons are cut into fans,
/// which is right for convex ones. [setup]
///
/// Comments of PLY, OBJ and .vtp, the title of an STL or .vtk, and fields of a .vtp may say SPACE=
/// and UNIT=, as Slicer does ("3D Slicer output. SPACE=LPS"). From RAS to LPS x and y are turned:
/// half a turn, so triangles face as before. An OBJ that ends between two lines cannot be told from
/// a shorter one. Throws std::runtime_error "FILE[:LINE]: what is wrong; what to do": unknown
/// ending, truncated, an index that no vertex has, a coordinate that is not finite, no triangle, an
/// unknown or contradictory SPACE= or UNIT= that `settings` do not settle.
MeshFile read_mesh(const std::filesystem::path& file, const MeshFileSettings& settings = {});

/// Whether a file is a mesh by its ending: .ply, .stl, .obj, .vtp, .vtk, in any case.      [any]
bool is_mesh_name(const std::filesystem::path& file);

/// How a file of write_ply() begins.
inline constexpr std::string_view kPlyBeginning =
    "ply\nformat binary_little_endian 1.0\ncomment SPACE=LPS\ncomment UNIT=mm\n";

/// Writes a binary little-endian PLY: double vertices in millimetres, LPS, said so in comments
/// ("SPACE=LPS", "UNIT=mm"), which `comments` follow, a line each. The file appears under its name
/// only when complete.  [setup] Throws std::runtime_error naming the file when it cannot be
/// written.
void write_ply(const TriangleMesh& mesh, const std::filesystem::path& file,
               const std::vector<std::string>& comments = {});

/// The mesh alone of a PLY, for files of our own; it may be empty. Throws as read_mesh().  [setup]
TriangleMesh read_ply(const std::filesystem::path& file);

} // namespace palpate
