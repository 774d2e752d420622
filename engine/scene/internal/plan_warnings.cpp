// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/internal/plan_warnings.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>

#include <fmt/format.h>

#include <palpate/engine/scene/baked_surface.h>
#include <palpate/engine/scene/contact_choice.h>
#include <palpate/engine/scene/internal/effect_questions.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/haptics/contact/guard_planes.h>
#include <palpate/haptics/contact/plane_bundle.h>

namespace palpate::internal {
namespace {

constexpr std::size_t kMeet = 4;    // surfaces at one place: more is rare in anatomy
constexpr std::size_t kTouches = 3; // facets that hold a mesh's proxy at a vertex
constexpr std::size_t kLeash = 1;   // plane of a guarded contact

/// Of the surfaces that meet at one place, those with the most.
std::size_t most_where_surfaces_meet(const Scene& scene) {
    std::map<std::string, std::size_t> of_surfaces;
    for (const PlannedEffect& planned : scene.plan().effects) {
        const EffectDescription& effect = scene.description().effects[planned.effect];
        if (!planned.on || !traits_of(effect).part) continue;
        for (const SceneSurface& surface : scene.surfaces())
            if (surface.name == surface_of(effect))
                of_surfaces[surface.name] += most_primitives_on(effect, surface);
    }
    std::vector<std::size_t> counts;
    counts.reserve(of_surfaces.size());
    for (const auto& [surface, count] : of_surfaces)
        counts.push_back(count);
    std::sort(counts.begin(), counts.end(), std::greater<>());
    counts.resize(std::min(counts.size(), kMeet));
    return std::accumulate(counts.begin(), counts.end(), std::size_t{0});
}

/// Between two meshes of their own stays the groove that baking closes where one has none
/// (labels_felt_alike).
void warn_of_grooves(const SceneDescription& scene, std::vector<std::string>& warnings) {
    SceneDescription bare = scene; // the surfaces with a mesh, as they are without it
    std::erase_if(bare.surfaces, [](const auto& named) { return !has_mesh(named.second); });
    for (auto& [name, surface] : bare.surfaces) {
        surface.mesh.clear();
        surface.triangle_mesh = nullptr;
    }
    for (const auto& [name, surface] : bare.surfaces)
        if (!labels_felt_alike(bare, name).empty())
            warnings.push_back(fmt::format(
                "surface {}: where it touches other labels that are felt and have a mesh of their "
                "own, too, the groove between them stays and may hold the proxy for long (flag "
                "stalled): leave mesh out, so that baking closes the groove",
                name));
}

/// A file is refused; where an option or a program chose the contact, the rest is felt.
void warn_of_textures(const Scene& scene, std::vector<std::string>& warnings) {
    for (const PlannedEffect& planned : scene.plan().effects) {
        const EffectDescription& effect = scene.description().effects[planned.effect];
        if (planned.on || traits_of(effect).part != SurfacePart::texture) continue;
        for (const SceneSurface& surface : scene.surfaces())
            if (surface.name == surface_of(effect) && !feels_texture(surface.contact))
                warnings.push_back(fmt::format("{} is left out: {}; take contact volume or guarded",
                                               effect_name(scene, planned.effect), planned.reason));
    }
}

/// What samples a volume stays where the scene has it, also where a surface of the volume moves.
void warn_of_what_stays(const Scene& scene, std::vector<std::string>& warnings) {
    const SceneDescription& description = scene.description();
    for (const PlannedEffect& planned : scene.plan().effects) {
        const EffectDescription& effect = description.effects[planned.effect];
        const std::string& volume = volume_of(effect);
        if (!effect.moves_with.empty() &&
            !scene.plan().uses_surface(description, effect.moves_with))
            warnings.push_back(fmt::format(
                "{} is left out: surface {} that it moves with is not felt; add an effect with "
                "type = \"surface\" and surface = \"{}\"",
                effect_name(scene, planned.effect), effect.moves_with, effect.moves_with));
        if (!planned.on || volume.empty() || !can_move(effect)) continue;
        if (!body_of(description, effect).empty()) continue;
        for (const SceneSurface& surface : scene.surfaces()) {
            const SurfaceDescription& felt = description.surfaces.at(surface.name);
            if (!felt.moves || felt.volume != volume) continue;
            warnings.push_back(fmt::format(
                "{} stays where it is when surface {} of its volume {} moves: say moves_with = "
                "\"{}\", and it goes along",
                effect_name(scene, planned.effect), surface.name, volume, surface.name));
            break;
        }
    }
}

} // namespace

std::size_t most_planes(const SceneSurface& surface) {
    // A mesh that gives way as a whole keeps its proxy's facets alone.
    const bool gives_way =
        std::isfinite(surface.level.strength_n) && surface.level.yielding == Yielding::holds;
    switch (surface.contact) {
    case ContactKind::mesh:
        return gives_way ? kTouches : GuardPlanes::kCapacity;
    case ContactKind::guarded:
        return kLeash + PlaneBundle::kCapacity;
    case ContactKind::volume:
    case ContactKind::direct:
        break;
    }
    return PlaneBundle::kCapacity;
}

std::string effect_name(const Scene& scene, std::size_t effect) {
    return fmt::format("effect {} ({})", effect + 1, name(scene.description().effects[effect]));
}

std::vector<FeltEffect> felt_effects(const Scene& scene, const LoopParts& parts) {
    std::vector<FeltEffect> effects;
    for (std::size_t i = 0; i < parts.effects.size(); ++i) {
        const std::size_t number = scene.effect_order()[i];
        effects.push_back({effect_name(scene, number), parts.effects[i].get()});
    }
    return effects;
}

std::vector<std::string> warnings_of(const Scene& scene, std::span<const FeltEffect> effects,
                                     double limit_n) {
    std::vector<std::string> warnings;
    std::size_t most = most_where_surfaces_meet(scene);
    for (const FeltEffect& felt : effects)
        most += felt.effect->most_primitives();
    if (most > PrimitiveSet::kCapacity)
        warnings.push_back(
            fmt::format("where all effects are felt at one place, they can add up to {} planes, "
                        "lines and points; an evaluation has room for {}, and the last ones are "
                        "left out (flag primitives_full): use fewer effects at one place",
                        most, PrimitiveSet::kCapacity));
    const bool is_devices = limit_n < scene.description().limits.force_n;
    for (const FeltEffect& felt : effects)
        if (const double force_n = felt.effect->unasked_force_n(); force_n > limit_n)
            warnings.push_back(fmt::format(
                "{} alone is up to {:.4g} N, and {}{:.4g} N is all that is sent: make it weaker{}",
                felt.name, force_n, is_devices ? "the device's " : "limits.force_n = ", limit_n,
                is_devices ? "" : " or raise the limit"));
    warn_of_grooves(scene.description(), warnings);
    warn_of_textures(scene, warnings);
    warn_of_what_stays(scene, warnings);
    return warnings;
}

} // namespace palpate::internal
