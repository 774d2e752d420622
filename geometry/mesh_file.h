// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <palpate/geometry/triangle_mesh.h>

namespace palpate {

/// Writes a binary little-endian PLY: double vertices in millimetres, LPS, said so in comments
/// ("SPACE=LPS", "UNIT=mm"), which `comments` follow, a line each. The file appears under its name
/// only when complete.  [setup] Throws std::runtime_error naming the file when it cannot be
/// written.
void write_ply(const TriangleMesh& mesh, const std::filesystem::path& file,
               const std::vector<std::string>& comments = {});

/// Reads a PLY (ascii or binary little-endian, float or double vertices, triangles or polygons cut
/// into fans), taken as millimetres in LPS unless a comment says otherwise (SPACE=RAS, UNIT=m).
/// [setup] Throws std::runtime_error "FILE[:LINE]: what is wrong; what to do".
TriangleMesh read_ply(const std::filesystem::path& file);

} // namespace palpate
