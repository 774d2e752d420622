// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <palpate/engine/scene/baked_surface.h>
#include <palpate/engine/scene/surface_mesh.h>

namespace palpate {

/// What baking did to a surface, in words, a line each: level, shift, volumes, components that were
/// dropped with their sizes, thin parts.                                                 [setup]
std::string baked_in_words(const BakedSurface& baked);

/// The same as JSON text; what the cache keeps beside the grid.                          [setup]
std::string baked_as_json(const BakedSurface& baked);

/// What the mesh is, in words, a line each: triangles, those without certificate, distance from the
/// level, warnings; and the same as JSON text.                                          [setup]
std::string mesh_in_words(const SurfaceMesh& mesh);
/// The numbers of mesh_in_words() as a JSON object.                                     [setup]
std::string mesh_as_json(const SurfaceMesh& mesh);

} // namespace palpate
