// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <palpate/engine/scene/baked_surface.h>
#include <palpate/engine/scene/scene_description.h>
#include <palpate/engine/scene/surface_mesh.h>
#include <palpate/haptics/contact/surface_contact.h>
#include <palpate/haptics/contact/surface_texture.h>
#include <palpate/haptics/contact/volume_contact.h>
#include <palpate/haptics/effects/effect.h>
#include <palpate/haptics/effects/surface_magnets.h>
#include <palpate/volume/fields/shared_samples.h>

namespace palpate {

/// A surface that is felt: the baked field and its level, the mesh where the contact needs one, or
/// a mesh alone.
struct SceneSurface {
    std::string name;
    ContactKind contact = ContactKind::volume;
    LevelSettings level;     ///< strength and yielding are a mesh's, too
    BakedSurface baked;      ///< without a field where the surface is a mesh alone
    SurfaceMesh mesh;        ///< empty where the contact needs none
    double leash_m = 0.0;    ///< contact guarded
    TextureSettings texture; ///< in front of the level, where an effect says so

    /// True where the mesh decides what is felt, and no field is sampled.                [any]
    bool is_felt_by_mesh() const noexcept { return contact == ContactKind::mesh; }
};

/// What one loop feels, with the state of it: surfaces by name, their finish, effects in
/// Scene::effect_order(). Who of them samples the same field at the same point shares the sample.
struct LoopParts {
    std::vector<std::unique_ptr<SurfaceContact>> contacts;
    std::vector<SurfaceFinish> finish; ///< of each of them
    std::vector<std::unique_ptr<Effect>> effects;
    SharedFields fields; ///< whose samples they share
};

} // namespace palpate
