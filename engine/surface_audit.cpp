// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/surface_audit.h>

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr double kChordSpacing = 25e-6;   // m between samples of a chord, but at most
constexpr double kMostChordSamples = 400; // of a long free flight
constexpr double kSearchRadius = 50e-3;   // m: deeper than any lost proxy in a head
constexpr int kNewtonSteps = 30;

std::uint64_t bit_in_reports(const Scene& scene, const SceneSurface& surface) {
    const auto index = &surface - scene.surfaces().data();
    return index < 64 ? std::uint64_t{1} << index : 0;
}

} // namespace

double level_distance(FieldSampler& sampler, const Vec3& point, double level,
                      double longest_step_m) {
    Vec3 x = point;
    for (int step = 0; step < kNewtonSteps; ++step) {
        const FieldSample here = sampler.sample(x);
        const double slope_squared = squared_length(here.slope);
        if (!(slope_squared > 0.0)) break;
        Vec3 move = ((level - here.value) / slope_squared) * here.slope;
        const double length = glm::length(move);
        if (length > longest_step_m) move *= longest_step_m / length;
        const Vec3 next = x + move;
        if (next == x) break;
        x = next;
    }
    const double distance = glm::length(point - x);
    return sampler.value(point) >= level ? distance : -distance;
}

SurfaceAudit::SurfaceAudit(const Scene& scene, const SceneSurface& surface)
    : surface_(surface), scale_(LevelScale::of(*surface.baked.field, surface.level)),
      sampler_(surface.baked.field->make_sampler()), bit_(bit_in_reports(scene, surface)) {
    const VolumeDescription& volume =
        scene.description().volumes.at(scene.description().surfaces.at(surface.name).volume);
    const double outwards = volume.analytic == "sphere_cavity"  ? 1.0
                            : volume.analytic == "solid_sphere" ? -1.0
                                                                : 0.0;
    // A surface that yields is not where the formula says.
    if (outwards != 0.0 && std::isinf(surface.level.strength_n))
        sphere_radius_m_ =
            1e-3 * volume.parameters.at("radius_mm") + outwards * surface.level.level;
}

void SurfaceAudit::add(const FrameReport& frame, std::span<const Vec3> path) {
    if ((frame.flags & kProbeNotFinite) || (frame.surfaces_open & bit_)) return;
    for (std::size_t i = 1; i < path.size(); ++i) {
        const Vec3 chord = path[i] - path[i - 1];
        const auto samples =
            static_cast<int>(std::min(1.0 + glm::length(chord) / kChordSpacing, kMostChordSamples));
        for (int k = 0; k <= samples; ++k) {
            const Vec3 p = path[i - 1] + (static_cast<double>(k) / samples) * chord;
            const double above = sampler_->value(p) - surface_.level.level;
            if (above <= deepest_.above_level) continue;
            deepest_.above_level = above;
            deepest_.frame = frame.frame;
            deepest_at_ = p;
        }
    }
    if (sampler_->value(frame.proxy) > surface_.level.level + scale_.certificate) ++frames_inside_;
    if (!(frame.surfaces_felt & bit_)) return;
    const double distance =
        level_distance(*sampler_, frame.proxy, surface_.level.level, scale_.trust_m);
    level_distance_m_.push_back(distance);
    if (sphere_radius_m_) {
        const Vec3 closest = *sphere_radius_m_ * glm::normalize(frame.probe);
        position_error_m_.push_back(glm::length(frame.proxy - closest));
    }
}

SurfaceAudit::Deepest SurfaceAudit::deepest() const {
    Deepest result = deepest_;
    if (result.above_level <= 0.0) return result;
    std::optional<SurfaceHit> hit;
    if (surface_.mesh) hit = surface_.mesh->closest_point(deepest_at_, kSearchRadius);
    result.depth_m = hit ? hit->distance_m
                         : std::abs(level_distance(*sampler_, deepest_at_, surface_.level.level,
                                                   scale_.trust_m));
    return result;
}

} // namespace palpate
