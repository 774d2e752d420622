// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <palpate/engine/scene/baked_surface.h>
#include <palpate/engine/scene/scene_description.h>
#include <palpate/geometry/certified_mesh.h>
#include <palpate/geometry/isosurface.h>
#include <palpate/geometry/surface_scene.h>
#include <palpate/volume/fields/level_distance.h>

namespace palpate {

/// How a mesh from a file lies to the level of the volume that it is given with.
struct MeshAgainstLevel {
    LevelDistance centroids;   ///< of the facets' centroids from the level
    double facing_share = 0.0; ///< of its area: facets that face as the field's level does, [0,1]
};

/// Where the mesh of a surface comes from.
struct MeshOrigin {
    std::filesystem::path file;        ///< empty: from memory, or extracted
    bool from_memory = false;          ///< given by the program, in memory
    bool from_cache = false;           ///< extracted, by an earlier run
    std::vector<std::string> warnings; ///< of reading the file, and what the defects of a given
                                       ///< mesh mean for contact
    std::optional<MeshAgainstLevel> against_level; ///< given beside a volume
};

/// A mesh as it was read or extracted.
struct FoundMesh : MeshOrigin {
    std::shared_ptr<const TriangleMesh> mesh; ///< scene frame, m
};

/// The mesh of a surface, with what its contact needs of it.
struct SurfaceMesh : MeshOrigin {
    std::shared_ptr<const SurfaceScene> scene;      ///< null: the contact needs no mesh
    std::shared_ptr<const CertifiedMesh> certified; ///< the same with neighbours and certificates;
                                                    ///< null where no contact walks on it (direct)
};

/// The mesh criteria that a scene asks for or, where it does not, those that fit: 2 mm and 0.2 mm
/// for an isosurface; half a voxel and a twentieth for labels, whose mesh is then as smooth as
/// their field. [setup]
IsosurfaceSettings mesh_settings(const SurfaceDescription& description, const BakedSurface& baked);

/// How far a guarded surface's proxy may get from the mesh's, m: what the scene says or, where it
/// does not, five times the facet distance that the mesh is extracted with; 1 mm for meshes that
/// are given. Where such a mesh is further than this from its volume's level, it is not of it.
/// [setup]
double leash_of(const SurfaceDescription& description, const BakedSurface& baked);

/// Looks at a mesh that was given, by a file or in memory: says in `found` what its defects mean
/// for contact and, beside a volume, how it lies to the level.                          [setup]
/// `place` begins messages about the scene: "FILE:LINE: [surface.bone]". Throws std::runtime_error
/// where the mesh is not of the baked field's level, or faces the other way.
void examine_mesh(FoundMesh& found, const SurfaceDescription& description,
                  const BakedSurface& baked, ContactKind contact, const std::string& place);

/// How far the facets of a mesh are from a level, by their centres.                     [setup]
std::string centroids_in_words(const LevelDistance& centroids);

/// Prepares a mesh for a contact.                                                       [setup]
/// Throws std::runtime_error when progress cancelled it.
SurfaceMesh make_surface_mesh(FoundMesh found, ContactKind contact, const Progress& progress = {});

} // namespace palpate
