// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <palpate/engine/scene/effect_plan.h>
#include <palpate/engine/scene/scene_description.h>
#include <palpate/engine/scene/scene_resources.h>
#include <palpate/geometry/vec.h>

namespace palpate {

namespace internal {
struct EffectFields;
}

class ScalarField;
class MovingSurface;
class SurfaceContact;
struct LoopParts;
struct SceneSurface;
struct SurfaceFinish;

/// A scene, loaded: everything that its plan needs and nothing else. Immutable; several loops may
/// share it.
class Scene {
public:
    /// Loads, bakes and extracts what the plan needs.                                    [setup]
    /// Throws std::invalid_argument as validate() does, of a scene made in code as of one from a
    /// file; std::runtime_error "FILE:LINE: what is wrong; what to do".
    explicit Scene(SceneDescription description, const SceneResources& resources = {});
    ~Scene();
    Scene& operator=(const Scene&) = delete;

    /// The same scene as one of its hands alone has it: its device is the hand's. It has the fields
    /// and meshes of this one, not others of its own, so that loops over both feel one thing.
    /// [setup] Throws std::invalid_argument as palpate::of_hand().
    std::shared_ptr<const Scene> of_hand(const std::string& hand) const;

    /// As it was given.                                                                   [any]
    const SceneDescription& description() const noexcept { return description_; }
    const EffectPlan& plan() const noexcept { return plan_; } ///< what is on, and why    [any]
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

    /// What a user should know of how volumes were read that an effect other than a surface uses,
    /// or a surface's strength, by the volume's name. [any]
    const VolumeWarnings& effect_warnings() const noexcept;

    /// What read its files, SceneResources::files; null where nobody did. [any]
    const SceneFiles* files() const noexcept { return files_.get(); }

private:
    Scene(const Scene&) = default;
    void shape_surfaces();
    const MovingSurface* body_among(const std::vector<std::unique_ptr<SurfaceContact>>& contacts,
                                    const EffectDescription& effect) const;
    std::vector<SurfaceFinish> finish_with(const internal::EffectFields& fields) const;

    SceneDescription description_;
    EffectPlan plan_;
    std::shared_ptr<const SceneFiles> files_;
    std::vector<SceneSurface> surfaces_;
    std::vector<std::size_t> effect_order_;
    std::shared_ptr<const internal::EffectFields> effect_fields_;
};

/// The field of a volume given by a formula; throws std::runtime_error naming file and line.
/// [setup]
std::shared_ptr<const ScalarField> make_analytic_field(const SceneDescription& scene,
                                                       const std::string& volume);

} // namespace palpate
