// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/effect_plan.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include <fmt/format.h>

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
    planned.start_samples = surface.strength_volume.empty() ? 0.0 : 1.0;
    return planned;
}

/// Where an effect other than a surface samples as others may, too.
internal::CommonPoint common_point(const EffectDescription& effect) {
    const bool in_surface = effect.kind == EffectKind::viscosity && !effect.surface.empty();
    if (effect.volume.empty() && !in_surface)
        return internal::CommonPoint::none; // the same everywhere
    const bool follows =
        effect.kind == EffectKind::vector_follow || effect.kind == EffectKind::fibre_follow;
    if (follows && effect.guide == FollowGuide::tangent) return internal::CommonPoint::proxy;
    return internal::traits_of(effect.kind).at;
}

/// But for whether its surface is felt.
PlannedEffect plan_friction(const EffectDescription& effect, std::set<std::string>& rubbing) {
    if (effect.friction.none()) return {0, false, "static is 0: it cannot be felt", ""};
    if (!rubbing.insert(effect.surface).second)
        return {0, false, "the same surface has friction already", ""};
    return {0, true, std::string(internal::traits_of(effect.kind).how), ""};
}

/// But for whether its surface is felt.
PlannedEffect plan_texture(const SceneDescription& scene, const EffectDescription& effect,
                           Extraction extraction, std::set<std::string>& textured) {
    if (effect.texture.none()) return {0, false, "height_mm is 0: it cannot be felt", ""};
    const ContactKind contact =
        choose_contact(scene, scene.surfaces.at(effect.surface), extraction).kind;
    if (!feels_texture(contact))
        return {0, false, fmt::format("contact {} has no texture", name(contact)), ""};
    if (!textured.insert(effect.surface).second)
        return {0, false, "the same surface has a texture already", ""};
    PlannedEffect planned{0, true, std::string(internal::traits_of(effect.kind).how), ""};
    planned.samples = effect.volume.empty() ? 0.0 : 1.0;
    return planned;
}

/// But for whether its surface is felt.
PlannedEffect plan_magnet(const EffectDescription& effect, std::set<std::string>& drawing) {
    if (effect.magnet.none()) return {0, false, "strength_n is 0: it cannot be felt", ""};
    if (!drawing.insert(effect.surface).second)
        return {0, false, "the same surface has a magnet already", ""};
    PlannedEffect planned{0, true, std::string(internal::traits_of(effect.kind).how), ""};
    planned.start_samples = effect.volume.empty() ? 0.0 : 1.0;
    return planned;
}

/// Surfaces that effects of one kind have already.
struct Taken {
    std::set<std::string> felt, rubbing, drawing, textured;
};

PlannedEffect plan_effect(const SceneDescription& scene, const EffectDescription& effect,
                          Extraction extraction, Taken& taken) {
    const internal::EffectTraits& traits = internal::traits_of(effect.kind);
    const auto off = [](const char* why) { return PlannedEffect{0, false, why, ""}; };
    if (effect.kind == EffectKind::surface) {
        const bool repeated = !taken.felt.insert(effect.surface).second;
        return plan_surface(scene, scene.surfaces.at(effect.surface), extraction, repeated);
    }
    if (effect.kind == EffectKind::magnet) return plan_magnet(effect, taken.drawing);
    if (effect.kind == EffectKind::texture)
        return plan_texture(scene, effect, extraction, taken.textured);
    if (traits.of_surface) return plan_friction(effect, taken.rubbing);
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
    PlannedEffect planned;
    planned.reason = traits.how;
    planned.samples = traits.further_samples;
    if (const internal::CommonPoint at = common_point(effect); at == internal::CommonPoint::proxy)
        planned.samples = 1.0;
    else if (at == internal::CommonPoint::frame_start)
        planned.start_samples = 1.0 + traits.further_start_samples;
    return planned;
}

/// Says whose samples an effect takes, and what is then left of its own.
class Sharing {
public:
    Sharing(const SceneDescription& scene, std::vector<PlannedEffect>& effects)
        : scene_(scene), effects_(effects) {}

    void settle() {
        for (PlannedEffect& planned : effects_)
            if (common_point(planned) == CommonPoint::proxy) at_proxy(planned);
        for (PlannedEffect& planned : effects_)
            if (planned.start_samples > 0.0) at_start(planned);
        for (PlannedEffect& planned : effects_)
            note_baked(planned);
    }

private:
    using CommonPoint = internal::CommonPoint;
    using Field = std::tuple<internal::FieldNeed, std::string, std::string>; // volume, surface

    const EffectDescription& effect_of(const PlannedEffect& planned) const {
        return scene_.effects[planned.effect];
    }

    CommonPoint common_point(const PlannedEffect& planned) const {
        if (!planned.on) return CommonPoint::none;
        const EffectDescription& effect = effect_of(planned);
        const bool of_surface = internal::traits_of(effect.kind).of_surface;
        if (!of_surface || effect.kind == EffectKind::magnet) return palpate::common_point(effect);
        return planned.samples > 0.0 ? CommonPoint::proxy : CommonPoint::none;
    }

    /// A surface of a formula has the formula itself; one of a file has its own, baked.
    Field field_of(const PlannedEffect& planned) const {
        const EffectDescription& effect = effect_of(planned);
        if (!effect.volume.empty())
            return {internal::traits_of(effect.kind).need, effect.volume, ""};
        const std::string& volume = scene_.surfaces.at(effect.surface).volume;
        const bool baked = !scene_.volumes.at(volume).file.empty();
        return {internal::FieldNeed::scalar, volume, baked ? effect.surface : ""};
    }

    /// A surface's own is of the strength that depends on the place.
    Field start_field_of(const PlannedEffect& planned) const {
        const EffectDescription& effect = effect_of(planned);
        if (effect.kind != EffectKind::surface) return field_of(planned);
        return {internal::FieldNeed::scalar, scene_.surfaces.at(effect.surface).strength_volume,
                ""};
    }

    void note(PlannedEffect& planned, const std::string& words) const {
        if (!planned.sharing.empty()) planned.sharing += "; ";
        planned.sharing += words;
    }

    std::string in_words(const PlannedEffect& planned) const {
        const EffectDescription& effect = effect_of(planned);
        return fmt::format("effect {} ({} of {})", planned.effect + 1, name(effect.kind),
                           effect.volume.empty() ? effect.surface : effect.volume);
    }

    void at_proxy(PlannedEffect& planned) {
        const auto [first, is_first] = first_at_proxy_.emplace(field_of(planned), &planned);
        if (is_first) return;
        planned.samples -= 1.0;
        note(planned, "shares its sample with " + in_words(*first->second));
    }

    void at_start(PlannedEffect& planned) {
        const std::string who =
            effect_of(planned).kind == EffectKind::surface ? "its strength shares" : "shares";
        // A frame's first evaluation is at its start.
        if (const auto first = first_at_proxy_.find(start_field_of(planned));
            first != first_at_proxy_.end()) {
            planned.start_samples -= 1.0;
            note(planned,
                 who + " its sample with the frame's first of " + in_words(*first->second));
            return;
        }
        const auto [first, is_first] = first_at_start_.emplace(start_field_of(planned), &planned);
        if (is_first) return;
        planned.start_samples -= 1.0;
        note(planned, who + " its sample at the frame's start with " + in_words(*first->second));
    }

    /// An effect of a volume whose surface is felt in a baked field: no sample in common.
    void note_baked(PlannedEffect& planned) const {
        if (!planned.on) return;
        const std::string& volume = effect_of(planned).volume;
        if (volume.empty() || scene_.volumes.at(volume).file.empty()) return;
        for (const PlannedEffect& other : effects_) {
            const EffectDescription& effect = effect_of(other);
            if (!other.on || effect.kind != EffectKind::surface || other.samples == 0.0) continue;
            if (scene_.surfaces.at(effect.surface).volume != volume) continue;
            note(planned,
                 fmt::format(
                     "shares nothing with surface {}, which is felt in a field baked from {}",
                     effect.surface, volume));
        }
    }

    const SceneDescription& scene_;
    std::vector<PlannedEffect>& effects_;
    std::map<Field, const PlannedEffect*> first_at_proxy_, first_at_start_;
};

/// Off, and asks for nothing any more.
void turn_off(PlannedEffect& planned, std::string reason) {
    planned = {planned.effect, false, std::move(reason), planned.contact};
}

/// Whether it is felt on any surface there is.
bool is_of_all_surfaces(const EffectDescription& effect) {
    return effect.kind == EffectKind::vibration && effect.surface.empty();
}

/// What is felt on a surface alone is off where that is not felt.
void turn_off_what_has_no_surface(const SceneDescription& scene, EffectPlan& plan,
                                  const std::set<std::string>& out_of_reach) {
    for (PlannedEffect& planned : plan.effects) {
        const std::string& surface = scene.effects[planned.effect].surface;
        if (!planned.on || !out_of_reach.contains(surface)) continue;
        turn_off(planned,
                 "surface " + surface + " is outside of the workspace: it cannot be reached");
        plan.relies_on_workspace = true;
    }
    const bool any_is_felt =
        std::any_of(scene.surfaces.begin(), scene.surfaces.end(),
                    [&](const auto& surface) { return plan.uses_surface(scene, surface.first); });
    for (PlannedEffect& planned : plan.effects) {
        const EffectDescription& effect = scene.effects[planned.effect];
        if (planned.on && is_of_all_surfaces(effect) && !any_is_felt)
            turn_off(planned, "no surface is felt");
        if (planned.on && !effect.surface.empty() && !plan.uses_surface(scene, effect.surface))
            turn_off(planned, "surface " + effect.surface + " is not felt");
    }
}

/// What is said of tissues and does nothing.
void add_idle_words(const SceneDescription& scene, EffectPlan& plan) {
    std::set<std::string> used;
    for (const auto& [surface, description] : scene.surfaces) {
        used.insert(description.material);
        if (description.yielding == Yielding::opens && std::isinf(description.strength_n))
            plan.left_out.push_back("yield = \"opens\" of surface " + surface +
                                    ": without strength_n it opens at no force");
    }
    for (const auto& [material, description] : scene.materials)
        if (!used.contains(material))
            plan.left_out.push_back("material " + material + ": no surface names it");
}

/// See EffectPlan::uncertified.
std::string why_uncertified(const SceneDescription& scene, const EffectPlan& plan) {
    bool is_felt = false;
    for (const PlannedEffect& planned : plan.effects) {
        if (!planned.on) continue;
        const EffectKind kind = scene.effects[planned.effect].kind;
        if (kind == EffectKind::surface) return {};
        is_felt = is_felt || kind == EffectKind::gradient_surface;
    }
    if (!is_felt) return {};
    return "no surface with a level is felt (a gradient_surface has none): method adaptive has "
           "nothing to certify here or to come back to and drifts by its few long steps; use "
           "method paper or fixed or feel a [surface.NAME] of the volume";
}

} // namespace

bool EffectPlan::uses_surface(const SceneDescription& scene, const std::string& surface) const {
    return std::any_of(effects.begin(), effects.end(), [&](const PlannedEffect& planned) {
        const EffectDescription& effect = scene.effects[planned.effect];
        return planned.on && effect.kind == EffectKind::surface && effect.surface == surface;
    });
}

EffectPlan plan_effects(const SceneDescription& scene, Extraction extraction,
                        const std::set<std::string>& out_of_reach) {
    EffectPlan plan;
    Taken taken;
    std::set<std::string> used_volumes, read_in_vain;
    for (std::size_t i = 0; i < scene.effects.size(); ++i) {
        PlannedEffect planned = plan_effect(scene, scene.effects[i], extraction, taken);
        planned.effect = i;
        plan.effects.push_back(planned);
    }
    turn_off_what_has_no_surface(scene, plan, out_of_reach);
    for (const PlannedEffect& planned : plan.effects)
        if (planned.on) used_volumes.insert(scene.effects[planned.effect].volume);
    Sharing(scene, plan.effects).settle();
    for (const auto& [surface, description] : scene.surfaces) {
        if (out_of_reach.contains(surface)) read_in_vain.insert(description.volume);
        if (!plan.uses_surface(scene, surface)) {
            plan.left_out.push_back("surface " + surface + ": no effect that is on names it");
            continue;
        }
        used_volumes.insert(description.volume);
        used_volumes.insert(description.strength_volume);
        if (!description.mesh.empty() &&
            !needs_mesh(choose_contact(scene, description, extraction).kind))
            plan.left_out.push_back("mesh of surface " + surface +
                                    ": its contact needs none; it is not read");
    }
    add_idle_words(scene, plan);
    for (const auto& [volume, description] : scene.volumes)
        if (!used_volumes.contains(volume))
            plan.left_out.push_back("volume " + volume + ": nothing that is on needs it" +
                                    (read_in_vain.contains(volume) ? "" : "; it is not read"));
    plan.uncertified = why_uncertified(scene, plan);
    return plan;
}

} // namespace palpate
