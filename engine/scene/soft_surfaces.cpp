// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/soft_surfaces.h>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <palpate/engine/scene/felt_stiffness.h>
#include <palpate/engine/scene/internal/effect_questions.h>
#include <palpate/engine/scene/internal/scene_ranges.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/haptics/stepping/subdivision.h>

namespace palpate {
namespace {

/// A stiffness in N/m, in N/mm.
std::string per_mm(double n_per_m) { return fmt::format("{:.3g} N/mm", 1e-3 * n_per_m); }

/// A slope of the hand's law, with the tissue's behind the coupling k.
std::string with_tissue(double slope, double k) {
    if (!(slope < k)) return per_mm(k) + " (as stiff as the coupling: hard)";
    return fmt::format("{} at the hand ({} of tissue behind the coupling's {})", per_mm(slope),
                       per_mm(1.0 / (1.0 / slope - 1.0 / k)), per_mm(k));
}

std::string in_words(const Softness& softness, const PressLaw& law, double k) {
    if (softness.count == 1) return with_tissue(law.slope(0.0), k);
    double softest = k, stiffest = 0.0;
    for (std::size_t i = 0; i < softness.count; ++i) {
        const Softness::Knot before = i == 0 ? Softness::Knot{} : softness.knots[i - 1];
        const double slope = (softness.knots[i].force_n - before.force_n) /
                             (softness.knots[i].press_m - before.press_m);
        softest = std::min(softest, slope);
        stiffest = std::max(stiffest, slope);
    }
    std::string words = fmt::format("{} to {} by {} points", per_mm(softest),
                                    per_mm(std::min(stiffest, k)), softness.count);
    if (!(stiffest < k))
        words += fmt::format("; stiffer pieces, up to {}, are felt as the coupling's {}: {}",
                             per_mm(stiffest), per_mm(k), stiffer_coupling_in_words(stiffest));
    return words;
}

/// Of the effects that count.
template <class Counts>
bool is_soft_and_alone(const SceneDescription& scene, const Counts& counts) {
    const std::string* soft = nullptr;
    for (std::size_t i = 0; i < scene.effects.size(); ++i) {
        const EffectDescription& effect = scene.effects[i];
        if (!counts(i)) continue;
        if (!internal::traits_of(effect).beside_soft) return false;
        if (!makes_surface_felt(effect)) continue;
        const std::string& surface = surface_of(effect);
        if (soft && *soft != surface) return false;
        if (!is_soft(scene, scene.surfaces.at(surface))) return false;
        soft = &surface;
    }
    return soft != nullptr;
}

} // namespace

bool is_soft(const SceneDescription& scene, const SurfaceDescription& surface) {
    return !PressLaw(surface.softness, scene.coupling.stiffness_n_per_m).is_hard();
}

std::string stiffer_coupling_in_words(double stiffness_n_per_m) {
    if (stiffness_n_per_m < internal::kCouplingStiffness.high)
        return fmt::format("raise [coupling] stiffness_n_per_m above {:.4g} to feel it, as far as "
                           "the device bears",
                           stiffness_n_per_m);
    return fmt::format("no coupling may be so stiff, as {:g} N/m is the most",
                       internal::kCouplingStiffness.high);
}

std::string softness_in_words(const SceneDescription& scene, const SurfaceDescription& surface) {
    const Softness& softness = surface.softness;
    if (softness.none()) return {};
    const double k = scene.coupling.stiffness_n_per_m;
    const PressLaw law(softness, k);
    if (law.is_hard())
        return fmt::format("hard: {} is not softer than the coupling's {}; {}{}",
                           per_mm(softness.steepest()), per_mm(k),
                           stiffer_coupling_in_words(softness.steepest()),
                           surface.beneath.empty() ? "" : "; until then nothing beneath is felt");
    std::string words = "soft: " + in_words(softness, law, k);
    const double force_n = std::min(scene.limits.force_n, surface.strength_n);
    if (const double deep_m = law.press_m(force_n); deep_m < 1.0) // m: no hand goes deeper
        words += fmt::format("; {:.3g} N with the hand {:.3g} mm behind the surface", force_n,
                             1e3 * deep_m);
    if (softness.damping > 0.0)
        words += fmt::format("; damped with {:.3g} N s/m", softness.damping);
    return words;
}

double stiffness_at(const Scene& scene, const SceneSurface& surface, const Vec3& place) {
    const SceneDescription& description = scene.description();
    const PressLaw law(description.surfaces.at(surface.name).softness,
                       description.coupling.stiffness_n_per_m);
    const auto& beneath = surface.baked.stiffness.map;
    return law.slope(0.0) * (beneath ? law.ratio_within(beneath->sample(place).ratio) : 1.0);
}

bool is_soft_and_alone(const SceneDescription& scene) {
    return is_soft_and_alone(scene, [](std::size_t) { return true; });
}

bool is_soft_and_alone(const Scene& scene) {
    return is_soft_and_alone(scene.description(),
                             [&](std::size_t effect) { return scene.plan().effects[effect].on; });
}

bool has_soft_layers(const Scene& scene) {
    const SceneDescription& said = scene.description();
    return !is_soft_and_alone(scene) &&
           std::any_of(scene.surfaces().begin(), scene.surfaces().end(),
                       [&](const SceneSurface& surface) {
                           return is_soft(said, said.surfaces.at(surface.name));
                       });
}

namespace internal {
namespace {

/// Of an effect of a scene that a loop feels with a method, and whether its soft surface is alone.
void check_effect(const SceneDescription& scene, std::size_t effect_index, SteppingMethod method,
                  bool is_alone) {
    const EffectDescription& effect = scene.effects[effect_index];
    const EffectTraits& traits = traits_of(effect);
    if (!traits.part || !is_soft(scene, scene.surfaces.at(surface_of(effect)))) return;
    const bool is_felt = std::any_of(
        scene.effects.begin(), scene.effects.end(), [&](const EffectDescription& other) {
            return makes_surface_felt(other) && surface_of(other) == surface_of(effect);
        });
    if (!is_felt) return;
    const SurfaceDescription& surface = scene.surfaces.at(surface_of(effect));
    const FieldCheck check(fmt::format("effects[{}]", effect_index));
    if (traits.part == SurfacePart::friction && !surface.beneath.empty())
        check.fail("surface",
                   fmt::format("= \"{}\" is stiffer over what lies beneath, and it rubs",
                               surface_of(effect)),
                   "leave friction on it out, or remove beneath");
    if (traits.part == SurfacePart::magnet)
        check.fail("surface", fmt::format("= \"{}\" is soft: it cannot draw", surface_of(effect)),
                   "leave the magnet out, or make it hard: stiffness_n_per_mm = inf");
    if (is_alone) return;
    const auto refuse = [&](const std::string& what, const std::string& remedy) {
        check.fail("surface",
                   fmt::format("= \"{}\" is soft, and not all that is felt: then {}",
                               surface_of(effect), what),
                   remedy + ", or make it hard: stiffness_n_per_mm = inf");
    };
    if (traits.part == SurfacePart::friction) refuse("it cannot rub", "leave friction on it out");
    if (!makes_surface_felt(effect)) return;
    if (!surface.beneath.empty())
        refuse("it cannot be stiffer over what lies beneath", "remove beneath");
    if (std::isfinite(surface.strength_n))
        refuse(fmt::format("it cannot yield (strength_n = {})", surface.strength_n),
               "remove strength_n, or let a table of stiffness_mm_n end flat");
    if (surface.moves) refuse("it cannot move (moves = true)", "remove moves");
    if (method != SteppingMethod::adaptive)
        refuse(fmt::format("the method cannot be {}", name(method)), "take method = \"adaptive\"");
    const auto soft = static_cast<std::size_t>(
        std::count_if(scene.effects.begin(), scene.effects.end(), [&](const auto& other) {
            return makes_surface_felt(other) &&
                   is_soft(scene, scene.surfaces.at(surface_of(other)));
        }));
    if (soft > Subdivision::kMostLayers)
        refuse(fmt::format("at most {} such surfaces can be felt, and there are {}",
                           Subdivision::kMostLayers, soft),
               "leave some of them out");
}

} // namespace

void check_beside_soft(const SceneDescription& scene, std::size_t effect_index) {
    check_effect(scene, effect_index, scene.loop.method, is_soft_and_alone(scene));
}

void check_soft_in_loop(const Scene& scene, SteppingMethod method,
                        std::span<const std::shared_ptr<Effect>> custom) {
    const bool is_alone = is_soft_and_alone(scene) &&
                          std::all_of(custom.begin(), custom.end(),
                                      [](const auto& effect) { return effect->only_pushes(); });
    for (std::size_t i = 0; i < scene.description().effects.size(); ++i)
        if (scene.plan().effects[i].on) check_effect(scene.description(), i, method, is_alone);
}

} // namespace internal
} // namespace palpate
