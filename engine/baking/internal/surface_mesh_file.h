// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <palpate/engine/scene/baked_surface.h>
#include <palpate/engine/scene/surface_mesh.h>

namespace palpate::internal {

/// Reads the mesh of a surface from its file.                                           [setup]
/// `place` begins messages about the scene: "FILE:LINE: [surface.bone]". Throws std::runtime_error:
/// as read_mesh(); where the mesh is not of the baked field's level, or faces the other way.
FoundMesh read_surface_mesh(const SurfaceDescription& description, const BakedSurface& baked,
                            ContactKind contact, const std::string& place);

/// How far a mesh is from a level.                                                      [setup]
std::string distance_in_words(const LevelDistance& centroids);

} // namespace palpate::internal
