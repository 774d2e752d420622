// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/effect_plan.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <fmt/format.h>

#include <palpate/engine/scene/contact_choice.h>
#include <palpate/engine/scene/internal/effect_questions.h>
#include <palpate/engine/scene/scene_file.h>

namespace palpate {
namespace {

using internal::EffectNeeds;

/// Says whose samples an effect takes, and what is then left of its own.
class Sharing {
public:
    Sharing(const SceneDescription& scene, const std::vector<EffectNeeds>& needs,
            std::vector<PlannedEffect>& effects)
        : scene_(scene), needs_(needs), effects_(effects) {}

    void settle() {
        for (PlannedEffect& planned : effects_)
            if (takes_part(planned) && needs_[planned.effect].at_proxy) at_proxy(planned);
        for (PlannedEffect& planned : effects_)
            if (takes_part(planned) && needs_[planned.effect].at_start) at_start(planned);
        for (PlannedEffect& planned : effects_)
            note_baked(planned);
    }

private:
    const EffectDescription& effect_of(const PlannedEffect& planned) const {
        return scene_.effects[planned.effect];
    }

    /// What moves with a body samples elsewhere than what stands still.
    bool takes_part(const PlannedEffect& planned) const {
        const EffectDescription& effect = effect_of(planned);
        const std::string& surface = surface_of(effect);
        const bool moves =
            !effect.moves_with.empty() || (!surface.empty() && scene_.surfaces.at(surface).moves);
        return planned.on && !moves;
    }

    void note(PlannedEffect& planned, const std::string& words) const {
        if (!planned.sharing.empty()) planned.sharing += "; ";
        planned.sharing += words;
    }

    std::string in_words(const PlannedEffect& planned) const {
        const EffectDescription& effect = effect_of(planned);
        return fmt::format("effect {} ({} of {})", planned.effect + 1, name(effect),
                           volume_of(effect).empty() ? surface_of(effect) : volume_of(effect));
    }

    void at_proxy(PlannedEffect& planned) {
        const auto [first, is_first] =
            first_at_proxy_.emplace(*needs_[planned.effect].at_proxy, &planned);
        if (is_first) return;
        planned.samples -= 1.0;
        note(planned, "shares its sample with " + in_words(*first->second));
    }

    void at_start(PlannedEffect& planned) {
        const internal::SampledField& field = *needs_[planned.effect].at_start;
        const std::string who =
            makes_surface_felt(effect_of(planned)) ? "its strength shares" : "shares";
        // A frame's first evaluation is at its start.
        if (const auto first = first_at_proxy_.find(field); first != first_at_proxy_.end()) {
            planned.start_samples -= 1.0;
            note(planned,
                 who + " its sample with the frame's first of " + in_words(*first->second));
            return;
        }
        const auto [first, is_first] = first_at_start_.emplace(field, &planned);
        if (is_first) return;
        planned.start_samples -= 1.0;
        note(planned, who + " its sample at the frame's start with " + in_words(*first->second));
    }

    /// An effect of a volume whose surface is felt in a baked field: no sample in common.
    void note_baked(PlannedEffect& planned) const {
        if (!planned.on) return;
        const std::string& volume = volume_of(effect_of(planned));
        if (volume.empty() || !is_baked(scene_.volumes.at(volume))) return;
        for (const PlannedEffect& other : effects_) {
            const EffectDescription& effect = effect_of(other);
            if (!other.on || !makes_surface_felt(effect) || other.samples == 0.0) continue;
            const std::string& surface = surface_of(effect);
            if (scene_.surfaces.at(surface).volume != volume) continue;
            note(planned,
                 fmt::format(
                     "shares nothing with surface {}, which is felt in a field baked from {}",
                     surface, volume));
        }
    }

    const SceneDescription& scene_;
    const std::vector<EffectNeeds>& needs_;
    std::vector<PlannedEffect>& effects_;
    std::map<internal::SampledField, const PlannedEffect*> first_at_proxy_, first_at_start_;
};

/// Off, and asks for nothing any more.
void turn_off(PlannedEffect& planned, std::string reason) {
    planned = {planned.effect, false, std::move(reason), planned.contact};
}

/// What is felt on a surface alone is off where that is not felt.
void turn_off_what_has_no_surface(const SceneDescription& scene,
                                  const std::vector<EffectNeeds>& needs, EffectPlan& plan,
                                  const std::set<std::string>& out_of_reach) {
    for (PlannedEffect& planned : plan.effects) {
        const std::string& surface = surface_of(scene.effects[planned.effect]);
        if (!planned.on || !out_of_reach.contains(surface)) continue;
        turn_off(planned,
                 "surface " + surface +
                     " is outside of the workspace: a trial that begins in it stays there");
        plan.relies_on_workspace = true;
    }
    const bool any_is_felt =
        std::any_of(scene.surfaces.begin(), scene.surfaces.end(),
                    [&](const auto& surface) { return plan.uses_surface(scene, surface.first); });
    for (PlannedEffect& planned : plan.effects) {
        const std::string& surface = surface_of(scene.effects[planned.effect]);
        if (planned.on && needs[planned.effect].any_surface && !any_is_felt)
            turn_off(planned, "no surface is felt");
        if (planned.on && !surface.empty() && !plan.uses_surface(scene, surface))
            turn_off(planned, "surface " + surface + " is not felt");
        const std::string& body = scene.effects[planned.effect].moves_with;
        if (planned.on && !body.empty() && !plan.uses_surface(scene, body))
            turn_off(planned, "surface " + body + " that it moves with is not felt");
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
        const EffectDescription& effect = scene.effects[planned.effect];
        if (makes_surface_felt(effect)) return {};
        is_felt = is_felt || internal::traits_of(effect).stands_for_surface;
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
        return planned.on && makes_surface_felt(effect) && surface_of(effect) == surface;
    });
}

EffectPlan plan_effects(const SceneDescription& scene, Extraction extraction,
                        const std::set<std::string>& out_of_reach) {
    EffectPlan plan;
    std::vector<EffectNeeds> needs;
    std::set<std::string> used_volumes, read_in_vain;
    for (const EffectDescription& effect : scene.effects) {
        needs.push_back(internal::needs_of(effect, {scene, extraction, plan.effects}));
        plan.effects.push_back(needs.back().planned);
        plan.effects.back().effect = plan.effects.size() - 1;
    }
    turn_off_what_has_no_surface(scene, needs, plan, out_of_reach);
    for (PlannedEffect& planned : plan.effects)
        if (const std::string& body = scene.effects[planned.effect].moves_with;
            planned.on && !body.empty())
            planned.reason += "; it moves with surface " + body;
    for (const PlannedEffect& planned : plan.effects)
        if (planned.on) used_volumes.insert(volume_of(scene.effects[planned.effect]));
    Sharing(scene, needs, plan.effects).settle();
    for (const auto& [surface, description] : scene.surfaces) {
        if (out_of_reach.contains(surface)) read_in_vain.insert(description.volume);
        if (!plan.uses_surface(scene, surface)) {
            plan.left_out.push_back("surface " + surface + ": no effect that is on names it");
            continue;
        }
        used_volumes.insert(description.volume);
        used_volumes.insert(description.strength_volume);
        if (has_mesh(description) &&
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
