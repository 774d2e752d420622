// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/truth/felt_level.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <palpate/engine/scene/internal/effect_questions.h>
#include <palpate/engine/scene/scene_surface.h>

namespace palpate {
namespace {

constexpr double kSearchRadius = 50e-3; // m: deeper than any lost proxy in a head
constexpr double kReached = 1e-3;       // of the value above the level: Newton's last steps

/// Whether any of 26 points at a distance is free.
bool is_free_around(FieldSampler& sampler, const Vec3& point, double radius_m, double level) {
    for (int i = -1; i <= 1; ++i)
        for (int j = -1; j <= 1; ++j)
            for (int k = -1; k <= 1; ++k) {
                if (i == 0 && j == 0 && k == 0) continue;
                const Vec3 direction = glm::normalize(Vec3(i, j, k));
                if (sampler.value(point + radius_m * direction) < level) return true;
            }
    return false;
}

/// Infinite where the slope does not lead to the level.
double distance_along_slope(FieldSampler& sampler, const Vec3& point, double level,
                            double trust_m) {
    const Vec3 foot = level_foot(sampler, point, level, trust_m);
    const double left = std::abs(sampler.value(foot) - level);
    const double above = sampler.value(point) - level;
    return left <= kReached * above ? glm::length(point - foot)
                                    : std::numeric_limits<double>::infinity();
}

} // namespace

std::vector<FeltLevel> felt_levels(const Scene& scene) {
    const bool alone = only_surfaces_act(scene);
    std::vector<FeltLevel> levels;
    std::size_t index = 0;
    for (const SceneSurface& surface : scene.surfaces()) {
        const std::uint64_t bit = felt_bit(index++);
        if (!surface.baked.field) continue;
        FeltLevel level{surface.baked.field, surface.level, {}, &surface, bit};
        const std::string& volume = scene.description().surfaces.at(surface.name).volume;
        if (alone && std::isinf(surface.level.strength_n))
            level.sphere =
                FeltSphere::of(scene.description().volumes.at(volume), surface.level.level);
        levels.push_back(std::move(level));
    }
    for (const PlannedEffect& planned : scene.plan().effects) {
        const EffectDescription& effect = scene.description().effects[planned.effect];
        if (!planned.on || !internal::traits_of(effect).stands_for_surface) continue;
        const VolumeDescription& volume = scene.description().volumes.at(volume_of(effect));
        if (volume.analytic.empty()) continue;
        levels.push_back({scene.effect_field(volume_of(effect)),
                          {},
                          alone ? FeltSphere::of(volume, 0.0) : std::nullopt,
                          nullptr,
                          0});
    }
    return levels;
}

bool only_surfaces_act(const Scene& scene) {
    for (const PlannedEffect& planned : scene.plan().effects) {
        const EffectDescription& effect = scene.description().effects[planned.effect];
        if (planned.on && !makes_surface_felt(effect) &&
            !internal::traits_of(effect).stands_for_surface)
            return false;
    }
    return true;
}

bool levels_hold_alone(const Scene& scene) {
    if (!only_surfaces_act(scene)) return false;
    for (const SceneSurface& surface : scene.surfaces())
        if (!surface.baked.field || std::isfinite(surface.level.strength_n)) return false;
    for (const PlannedEffect& planned : scene.plan().effects) {
        const EffectDescription& effect = scene.description().effects[planned.effect];
        if (planned.on && !makes_surface_felt(effect) &&
            scene.description().volumes.at(volume_of(effect)).analytic.empty())
            return false;
    }
    return true;
}

double depth_behind(const FeltLevel& level, FieldSampler& sampler, const Vec3& point,
                    double trust_m, double deepest_m) {
    const double c = level.settings.level;
    if (!(sampler.value(point) > c)) return 0.0;
    const double along_slope = distance_along_slope(sampler, point, c, trust_m);
    if (along_slope <= deepest_m) return along_slope;
    // From far behind the slope may lead to another sheet, or to none.
    for (double radius_m = trust_m; radius_m < kSearchRadius; radius_m += trust_m)
        if (is_free_around(sampler, point, radius_m, c)) return std::min(along_slope, radius_m);
    return std::min(along_slope, kSearchRadius);
}

} // namespace palpate
