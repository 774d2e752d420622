// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/effect_plan.h>

#include <algorithm>
#include <set>

#include <palpate/engine/internal/effect_kinds.h>
#include <palpate/engine/scene_file.h>

namespace palpate {
namespace {

PlannedEffect plan_surface(const SceneDescription& scene, const SurfaceDescription& surface,
                           Extraction extraction, bool repeated) {
    const ContactChoice choice = choose_contact(scene, surface, extraction);
    PlannedEffect planned;
    planned.contact = name(choice.kind);
    if (repeated) return {0, false, "the same surface is felt already", planned.contact};
    if (surface.strength_n == 0.0)
        return {0, false, "strength_n is 0: it cannot be felt", planned.contact};
    planned.reason = "felt up to its strength; " + choice.why;
    planned.needs_mesh = needs_mesh(choice.kind);
    planned.rays = planned.needs_mesh ? 1.0 : 0.0;
    planned.samples = samples_field(choice.kind) ? 1.0 : 0.0;
    const bool certified_by_field =
        choice.kind == ContactKind::volume || choice.kind == ContactKind::guarded;
    planned.roots = certified_by_field ? 1.0 : 0.0;
    planned.needs_hessian = certified_by_field;
    return planned;
}

/// But for whether its surface is felt.
PlannedEffect plan_friction(const EffectDescription& effect, std::set<std::string>& rubbing) {
    if (effect.friction.none()) return {0, false, "static is 0: it cannot be felt", ""};
    if (!rubbing.insert(effect.surface).second)
        return {0, false, "the same surface has friction already", ""};
    return {0, true, std::string(internal::traits_of(effect.kind).how), ""};
}

PlannedEffect plan_effect(const SceneDescription& scene, const EffectDescription& effect,
                          Extraction extraction, std::set<std::string>& felt,
                          std::set<std::string>& rubbing) {
    const internal::EffectTraits& traits = internal::traits_of(effect.kind);
    const auto off = [](const char* why) { return PlannedEffect{0, false, why, ""}; };
    if (effect.kind == EffectKind::surface) {
        const bool repeated = !felt.insert(effect.surface).second;
        return plan_surface(scene, scene.surfaces.at(effect.surface), extraction, repeated);
    }
    if (traits.of_surface) return plan_friction(effect, rubbing);
    switch (effect.kind) {
    case EffectKind::constant_force:
        if (effect.force_n == std::array<double, 3>{0.0, 0.0, 0.0})
            return off("force_n is 0: it cannot be felt");
        break;
    case EffectKind::guide:
    case EffectKind::workspace:
        if (effect.guide_settings.strength_n == 0.0)
            return off("strength_n is 0: it cannot be felt");
        break;
    case EffectKind::vibration:
        if (effect.vibration.amplitude_n_s_per_m == 0.0 || effect.vibration.most_n == 0.0)
            return off("amplitude_n_s_per_m or most_n is 0: it cannot be felt");
        break;
    case EffectKind::gravity_compensation:
        if (effect.mass_kg == 0.0) return off("mass_kg is 0: there is nothing to carry");
        break;
    case EffectKind::viscosity:
        if (effect.strength.is_zero())
            return off("damping_n_s_per_m is 0 everywhere: it cannot be felt");
        break;
    default:
        if (effect.strength.is_zero()) return off("strength_n is 0 everywhere: it cannot be felt");
    }
    return {0, true, std::string(traits.how), "", traits.samples};
}

} // namespace

bool EffectPlan::uses_surface(const SceneDescription& scene, const std::string& surface) const {
    return std::any_of(effects.begin(), effects.end(), [&](const PlannedEffect& planned) {
        const EffectDescription& effect = scene.effects[planned.effect];
        return planned.on && effect.kind == EffectKind::surface && effect.surface == surface;
    });
}

EffectPlan plan_effects(const SceneDescription& scene, Extraction extraction) {
    EffectPlan plan;
    std::set<std::string> felt;
    std::set<std::string> rubbing;
    std::set<std::string> used_volumes;
    for (std::size_t i = 0; i < scene.effects.size(); ++i) {
        PlannedEffect planned = plan_effect(scene, scene.effects[i], extraction, felt, rubbing);
        planned.effect = i;
        if (planned.on) used_volumes.insert(scene.effects[i].volume);
        plan.effects.push_back(planned);
    }
    for (PlannedEffect& planned : plan.effects) {
        const EffectDescription& effect = scene.effects[planned.effect];
        if (!planned.on || effect.surface.empty() || plan.uses_surface(scene, effect.surface))
            continue;
        planned.on = false;
        planned.reason = "surface " + effect.surface + " is not felt";
    }
    for (const auto& [surface, description] : scene.surfaces) {
        if (!plan.uses_surface(scene, surface)) {
            plan.left_out.push_back("surface " + surface + ": no effect that is on names it");
            continue;
        }
        used_volumes.insert(description.volume);
        if (!description.mesh.empty() &&
            !needs_mesh(choose_contact(scene, description, extraction).kind))
            plan.left_out.push_back("mesh of surface " + surface +
                                    ": its contact needs none; it is not read");
    }
    for (const auto& [volume, description] : scene.volumes)
        if (!used_volumes.contains(volume))
            plan.left_out.push_back("volume " + volume +
                                    ": nothing that is on needs it; it is not read");
    return plan;
}

} // namespace palpate
