// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <palpate/engine/scene/baked_surface.h>
#include <palpate/engine/scene/scene_description.h>
#include <palpate/engine/scene/surface_mesh.h>
#include <palpate/haptics/contact/level_settings.h>
#include <palpate/haptics/contact/surface_texture.h>

namespace palpate {

/// A surface that is felt: the baked field and its level, the mesh where the contact needs one, or
/// a mesh alone.
struct SceneSurface {
    std::string name;                          ///< key of SceneDescription::surfaces
    ContactKind contact = ContactKind::volume; ///< as given, or as choose_contact() decided
    LevelSettings level;                       ///< strength and yielding are a mesh's, too
    BakedSurface baked;      ///< without a field where the surface is a mesh alone
    SurfaceMesh mesh;        ///< empty where the contact needs none
    double leash_m = 0.0;    ///< contact guarded
    TextureSettings texture; ///< in front of the level, where an effect says so

    /// True where the mesh decides what is felt, and no field is sampled.                [any]
    bool is_felt_by_mesh() const noexcept { return contact == ContactKind::mesh; }
};

} // namespace palpate
