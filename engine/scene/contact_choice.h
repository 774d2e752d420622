// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <palpate/engine/scene/scene_description.h>
#include <palpate/engine/scene/scene_resources.h>

namespace palpate {

/// How a surface is felt, and why so.
struct ContactChoice {
    ContactKind kind = ContactKind::volume; ///< which
    std::string why;                        ///< in words
};

/// The contact that the scene names or, where it names none, the safest that the surface's data and
/// the build allow: mesh for a mesh alone, guarded where there is a volume and a mesh can be had,
/// else volume. The one place where this is decided.                                    [setup]
ContactChoice choose_contact(const SceneDescription& scene, const SurfaceDescription& surface,
                             Extraction extraction);

/// Whether a contact reads the surface's mesh.                                          [any]
bool needs_mesh(ContactKind kind) noexcept;
/// Whether a contact's loop samples the surface's field.                                [any]
bool samples_field(ContactKind kind) noexcept;

/// Whether a contact feels textures: those that a field's level leads.                   [any]
bool feels_texture(ContactKind kind) noexcept;

/// What a contact lacks in what a surface is given by, and what to do about it: "CONTACT what;
/// remedy".
struct ContactObstacle {
    std::string what;   ///< is missing, or too much, in words
    std::string remedy; ///< what to do about it
};

/// The scene as it can be felt before any mesh is extracted: a surface for which one would be is
/// felt by its volume alone (ContactKind::volume). What has a mesh already, or needs none, stays.
/// [setup]
SceneDescription preview_of(SceneDescription scene);

/// A volume where there is a mesh alone, a mesh of a formula: nothing where the contact can work.
/// [setup]
std::optional<ContactObstacle> obstacle(const SceneDescription& scene,
                                        const SurfaceDescription& surface, ContactKind kind);

} // namespace palpate
