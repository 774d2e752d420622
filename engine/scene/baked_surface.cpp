// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/baked_surface.h>

#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include <palpate/engine/scene/scene_place.h>
#include <palpate/engine/scene/soft_surfaces.h>

namespace palpate {
namespace {

/// Whether a surface is one of labels that others may be joined to: whole, smoothed, hard, and
/// always where its neighbours are. One that gives way shows where it ends.
bool may_be_joined(const SceneDescription& scene, const SurfaceDescription& surface) {
    return !surface.labels.empty() && !surface.region_mm && !surface.moves &&
           surface.keep.kind == ComponentPolicy::Kind::all && smoothing_of(surface) > 0.0 &&
           std::isinf(surface.strength_n) && surface.strength_volume.empty() &&
           !is_soft(scene, surface);
}

/// Refuses a level beyond the value that the formula has at its deepest, or that a field of the
/// program's own never has.
void require_level_of_formula(const VolumeDescription& source, const BakedSurface& baked,
                              const std::string& place) {
    if (baked.field->typical_slope(baked.level) > 0.0) return;
    if (source.scalar_field)
        throw std::runtime_error(fmt::format("{}: iso_value {} is reached nowhere by scalar_field, "
                                             "whose typical_slope() is 0 there; choose a level "
                                             "that it has, or correct typical_slope()",
                                             place, baked.level));
    Vec3 deepest(0.0);
    if (source.analytic == "torus") deepest.x = 1e-3 * source.parameters.at("radius_mm");
    const double end = baked.field->make_sampler()->value(deepest);
    const bool above = baked.level >= end;
    throw std::runtime_error(fmt::format(
        "{}: iso_value {} is reached nowhere by analytic = \"{}\", whose values in m {} {:.6g}; "
        "choose one {} it",
        place, baked.level, source.analytic, above ? "go up to" : "begin at", end,
        above ? "below" : "above"));
}

} // namespace

BakedSurface bake_formula(const SceneDescription& scene, const std::string& surface,
                          std::shared_ptr<const ScalarField> field) {
    const SurfaceDescription& description = scene.surfaces.at(surface);
    BakedSurface baked;
    baked.field = std::move(field);
    baked.level = description.iso_value;
    require_level_of_formula(scene.volumes.at(description.volume), baked,
                             place_of_surface(scene, surface));
    return baked;
}

std::vector<std::string> labels_felt_alike(const SceneDescription& scene,
                                           const std::string& surface) {
    const SurfaceDescription& own = scene.surfaces.at(surface);
    std::vector<std::string> labels;
    // A mesh of its own is of the label alone: its field has to stay so, too.
    if (!may_be_joined(scene, own) || has_mesh(own)) return labels;
    std::set<std::string> felt;
    for (const EffectDescription& effect : scene.effects)
        if (makes_surface_felt(effect)) felt.insert(surface_of(effect));
    if (!felt.contains(surface)) return labels;
    for (const std::string& name : felt) {
        const auto found = scene.surfaces.find(name);
        if (name == surface || found == scene.surfaces.end()) continue;
        const SurfaceDescription& other = found->second;
        if (may_be_joined(scene, other) && other.volume == own.volume &&
            smoothing_of(other) == smoothing_of(own) && iso_rule_of(other) == iso_rule_of(own))
            labels.insert(labels.end(), other.labels.begin(), other.labels.end());
    }
    return labels;
}

} // namespace palpate
