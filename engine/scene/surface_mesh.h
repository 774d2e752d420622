// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <palpate/engine/scene/baked_surface.h>
#include <palpate/engine/scene/scene_description.h>
#include <palpate/engine/scene/scene_resources.h>
#include <palpate/geometry/certified_mesh.h>
#include <palpate/geometry/surface_scene.h>
#include <palpate/volume/fields/level_distance.h>

namespace palpate {

/// How a mesh from a file lies to the level of the volume that it is given with.
struct MeshAgainstLevel {
    LevelDistance centroids;   ///< of the facets' centroids from the level
    double facing_share = 0.0; ///< of its area: facets that face as the field's level does, [0,1]
};

/// The mesh of a surface, with what its contact needs of it.
struct SurfaceMesh {
    std::shared_ptr<const SurfaceScene> scene;      ///< null: the contact needs no mesh
    std::shared_ptr<const CertifiedMesh> certified; ///< the same with neighbours and certificates;
                                                    ///< null where no contact walks on it (direct)
    std::filesystem::path file;                     ///< empty: extracted
    bool from_cache = false;                        ///< extracted, by an earlier run
    std::vector<std::string> warnings; ///< of reading the file, and what its defects mean for
                                       ///< contact
    std::optional<MeshAgainstLevel> against_level; ///< file beside a volume
};

/// How far a guarded surface's proxy may get from the mesh's, m: what the scene says or, where it
/// does not, five times the facet distance that the mesh is extracted with; 1 mm for files. Where a
/// mesh from a file is further than this from its volume's level, it is not a mesh of it.
/// [setup]
double leash_of(const SurfaceDescription& description, const BakedSurface& baked);

/// Reads the mesh of a surface from its file, or extracts it from the baked field, and prepares it
/// for a contact.                                                                       [setup]
/// `place` begins messages about the scene: "FILE:LINE: [surface.bone]". Throws std::runtime_error:
/// as read_mesh() and mesh_surface(); a file whose mesh is not of the baked field's level, or faces
/// the other way.
SurfaceMesh make_surface_mesh(const SurfaceDescription& description, const BakedSurface& baked,
                              ContactKind contact, const std::string& place,
                              const SceneResources& resources);

/// What the mesh is, in words, a line each: triangles, those without certificate, distance from the
/// level, warnings; and the same as JSON text.                                          [setup]
std::string mesh_in_words(const SurfaceMesh& mesh);
std::string mesh_as_json(const SurfaceMesh& mesh);

} // namespace palpate
