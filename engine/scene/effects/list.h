// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

#include <palpate/engine/scene/effects/constant_force.h>
#include <palpate/engine/scene/effects/friction.h>
#include <palpate/engine/scene/effects/gradient_force.h>
#include <palpate/engine/scene/effects/gradient_surface.h>
#include <palpate/engine/scene/effects/gravity_compensation.h>
#include <palpate/engine/scene/effects/guide.h>
#include <palpate/engine/scene/effects/magnet.h>
#include <palpate/engine/scene/effects/surface.h>
#include <palpate/engine/scene/effects/texture.h>
#include <palpate/engine/scene/effects/vector_follow.h>
#include <palpate/engine/scene/effects/vector_force.h>
#include <palpate/engine/scene/effects/vector_sheet.h>
#include <palpate/engine/scene/effects/vibration.h>
#include <palpate/engine/scene/effects/viscosity.h>
#include <palpate/engine/scene/effects/workspace.h>

namespace palpate {

/// All kinds of effects: the one list. Of effects with the same turn in a frame, those of an
/// earlier kind come first, so a new kind goes to the end: else scenes get other bits.
using EffectSettings =
    std::variant<effects::Surface, effects::GradientSurface, effects::ConstantForce,
                 effects::GradientForce, effects::Viscosity, effects::VectorForce,
                 effects::VectorFollow, effects::FibreFollow, effects::FrontShape, effects::Vortex,
                 effects::Friction, effects::StickSlip, effects::Guide, effects::Workspace,
                 effects::Vibration, effects::GravityCompensation, effects::Magnet,
                 effects::Texture>;

namespace internal {

template <class Kind, class List>
inline constexpr bool kIsOneOf = false;
template <class Kind, class... Kinds>
inline constexpr bool kIsOneOf<Kind, std::variant<Kinds...>> = (std::is_same_v<Kind, Kinds> || ...);

} // namespace internal

/// One effect of a scene: scene.effects.push_back(effects::Friction{.surface = "bone",
/// .static_mu = 0.3, .dynamic_mu = 0.2}).
struct EffectDescription {
    EffectSettings settings;     ///< which kind it is, and that kind's own settings
    int line = 0;                ///< of the scene file, for messages; 0: made in code
    std::string moves_with = {}; ///< surface whose body it goes along with: one that `moves`, key
                                 ///< of SceneDescription::surfaces; empty: it stands still

    EffectDescription() = default;
    /// Of the settings of a kind, as effects::Surface; `of_line` as `line`.                 [setup]
    template <class Kind>
    requires internal::kIsOneOf<Kind, EffectSettings> EffectDescription(Kind of, int of_line = 0)
        : settings(std::move(of)), line(of_line) {}
};

/// The name of its kind as scene files spell it, under `type`.                          [any]
std::string_view name(const EffectDescription& effect) noexcept;
/// The surface that it is of: key of SceneDescription::surfaces; empty where it is of none, or of
/// any.                                                                                 [any]
const std::string& surface_of(const EffectDescription& effect) noexcept;
/// The volume that it samples: key of SceneDescription::volumes; empty where there is none.  [any]
const std::string& volume_of(const EffectDescription& effect) noexcept;
/// The file that some of its settings were read from; empty where there is none.        [any]
const std::filesystem::path& file_of(const EffectDescription& effect) noexcept;
/// Whether effects of its kind can go along with a body (moves_with).                   [any]
bool can_move(const EffectDescription& effect) noexcept;
/// Whether it is what makes surface_of() felt at all; other effects are felt on or beside
/// surfaces.                                                                            [any]
bool makes_surface_felt(const EffectDescription& effect) noexcept;

} // namespace palpate
