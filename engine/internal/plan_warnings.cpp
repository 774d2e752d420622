// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/internal/plan_warnings.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>

#include <fmt/format.h>

#include <palpate/engine/scene_file.h>
#include <palpate/haptics/gravity_compensation.h>
#include <palpate/haptics/guard_planes.h>
#include <palpate/haptics/plane_bundle.h>
#include <palpate/haptics/workspace.h>

namespace palpate::internal {
namespace {

constexpr std::size_t kMeet = 4;     // surfaces at one place: more is rare in anatomy
constexpr std::size_t kTouches = 3;  // facets that hold a mesh's proxy at a vertex
constexpr std::size_t kLeash = 1;    // plane of a guarded contact
constexpr std::size_t kSides = 2;    // opposed planes of a sheet
constexpr std::size_t kBoxSides = 6; // planes of a workspace that is a box

/// The most planes that a surface offers in an evaluation.
std::size_t most_planes(const SceneDescription& scene, const SurfaceDescription& surface,
                        Extraction extraction) {
    const ContactKind contact = choose_contact(scene, surface, extraction).kind;
    // Of what gives way as a whole several planes would resist more than it.
    const bool gives_way = std::isfinite(surface.strength_n) && surface.yielding == Yielding::holds;
    switch (contact) {
    case ContactKind::mesh:
        return gives_way ? kTouches : GuardPlanes::kCapacity;
    case ContactKind::guarded:
        return kLeash + (gives_way ? 1 : PlaneBundle::kCapacity);
    case ContactKind::volume:
        return gives_way ? 1 : PlaneBundle::kCapacity;
    case ContactKind::direct:
        break;
    }
    return PlaneBundle::kCapacity;
}

/// The most planes, lines and points that an effect adds in an evaluation.
std::size_t most_primitives(const SceneDescription& scene, const EffectDescription& effect,
                            Extraction extraction) {
    switch (effect.kind) {
    case EffectKind::surface:
    case EffectKind::friction: // a line for each of the surface's planes
    case EffectKind::stick_slip:
        return most_planes(scene, scene.surfaces.at(effect.surface), extraction);
    case EffectKind::gradient_surface:
    case EffectKind::vector_follow:
    case EffectKind::fibre_follow:
    case EffectKind::guide:
    case EffectKind::magnet:
        return 1;
    case EffectKind::front_shape:
    case EffectKind::vortex:
        return kSides;
    case EffectKind::workspace:
        if (effect.radius_m == 0.0) return kBoxSides;
        return std::isinf(effect.guide_settings.strength_n) ? WorkspaceSphere::kCuts : 1;
    case EffectKind::constant_force:
    case EffectKind::gradient_force:
    case EffectKind::viscosity:
    case EffectKind::vector_force:
    case EffectKind::vibration:
    case EffectKind::gravity_compensation:
    case EffectKind::texture:
        break;
    }
    return 0;
}

std::string room_warning(const SceneDescription& scene, const EffectPlan& plan,
                         Extraction extraction) {
    std::map<std::string, std::size_t> of_surfaces;
    std::size_t most = 0;
    for (const PlannedEffect& planned : plan.effects) {
        if (!planned.on) continue;
        const EffectDescription& effect = scene.effects[planned.effect];
        std::size_t& sum = effect.surface.empty() ? most : of_surfaces[effect.surface];
        sum += most_primitives(scene, effect, extraction);
    }
    std::vector<std::size_t> counts;
    for (const auto& [surface, count] : of_surfaces)
        counts.push_back(count);
    std::sort(counts.begin(), counts.end(), std::greater<>());
    counts.resize(std::min(counts.size(), kMeet));
    most = std::accumulate(counts.begin(), counts.end(), most);
    if (most <= PrimitiveSet::kCapacity) return "";
    return fmt::format("where all effects are felt at one place, they can add up to {} planes, "
                       "lines and points; an evaluation has room for {}, and the last ones are "
                       "left out (flag primitives_full): use fewer effects at one place",
                       most, PrimitiveSet::kCapacity);
}

/// The force that an effect alone asks for wherever the hand is, N; 0 where that depends.
double steady_force_n(const EffectDescription& effect) {
    if (effect.kind == EffectKind::constant_force)
        return std::hypot(effect.force_n[0], effect.force_n[1], effect.force_n[2]);
    if (effect.kind == EffectKind::gravity_compensation)
        return effect.mass_kg * GravityCompensation::kStandardGravity;
    return 0.0;
}

} // namespace

std::vector<std::string> warnings_of(const SceneDescription& scene, const EffectPlan& plan,
                                     Extraction extraction) {
    std::vector<std::string> warnings;
    if (std::string room = room_warning(scene, plan, extraction); !room.empty())
        warnings.push_back(std::move(room));
    for (const PlannedEffect& planned : plan.effects) {
        const EffectDescription& effect = scene.effects[planned.effect];
        const double force_n = steady_force_n(effect);
        if (planned.on && force_n > scene.limits.force_n)
            warnings.push_back(
                fmt::format("effect {} ({}) alone is {:.4g} N, and limits.force_n = {:.4g} N is "
                            "all that is sent: make it weaker or raise the limit",
                            planned.effect + 1, name(effect.kind), force_n, scene.limits.force_n));
    }
    return warnings;
}

} // namespace palpate::internal
