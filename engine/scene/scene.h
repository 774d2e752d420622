// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <palpate/engine/scene/baked_surface.h>
#include <palpate/engine/scene/effect_plan.h>
#include <palpate/engine/scene/scene_description.h>
#include <palpate/engine/scene/scene_resources.h>
#include <palpate/engine/scene/surface_mesh.h>
#include <palpate/haptics/contact/surface_contact.h>
#include <palpate/haptics/contact/volume_contact.h>
#include <palpate/haptics/effects/effect.h>
#include <palpate/haptics/effects/surface_magnets.h>
#include <palpate/volume/fields/shared_samples.h>

namespace palpate {

namespace internal {
struct EffectFields;
}

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

/// A scene, loaded: everything that its plan needs and nothing else. Immutable; several loops may
/// share it.
class Scene {
public:
    /// Loads, bakes and extracts what the plan needs.                                    [setup]
    /// Throws std::invalid_argument as validate() does, of a scene made in code as of one from a
    /// file; std::runtime_error "FILE:LINE: what is wrong; what to do".
    explicit Scene(SceneDescription description, const SceneResources& resources = {});

    const SceneDescription& description() const noexcept { return description_; }
    const EffectPlan& plan() const noexcept { return plan_; }
    const std::vector<SceneSurface>& surfaces() const noexcept {
        return surfaces_;
    } ///< that are felt, by name

    /// Fresh parts for a loop, of what is on: effects in effect_order().                 [setup]
    LoopParts make_parts() const;
    /// Effects of the scene's description that make_parts() makes, in its order: the same for any
    /// order in which a scene names them.  [any]
    const std::vector<std::size_t>& effect_order() const noexcept { return effect_order_; }
    /// A fresh contact with one surface alone.                                          [setup]
    std::unique_ptr<SurfaceContact> make_contact(const SceneSurface& surface) const;

    /// The scalar field of a volume that an effect other than a surface uses; null where none does.
    /// [any]
    std::shared_ptr<const ScalarField> effect_field(const std::string& volume) const;
    /// The bounds of a volume that an effect other than a surface uses, of scalars or of vectors;
    /// nothing where none does. [any]
    std::optional<Box> effect_bounds(const std::string& volume) const;

private:
    void shape_surfaces();
    std::vector<SurfaceFinish> finish_with(const internal::EffectFields& fields) const;

    SceneDescription description_;
    EffectPlan plan_;
    std::vector<SceneSurface> surfaces_;
    std::vector<std::size_t> effect_order_;
    std::shared_ptr<const internal::EffectFields> effect_fields_;
};

/// The field of a volume given by a formula; throws std::runtime_error naming file and line.
/// [setup]
std::shared_ptr<const ScalarField> make_analytic_field(const SceneDescription& scene,
                                                       const std::string& volume);

} // namespace palpate
