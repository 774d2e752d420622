// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/truth/surface_audit.h>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/truth/felt_level.h>

namespace palpate {
namespace {

constexpr double kChordSpacing = 25e-6;   // m between samples of a chord, but at most
constexpr double kMostChordSamples = 400; // of a long free flight
constexpr double kSearchRadius = 50e-3;   // m: deeper than any lost proxy in a head
constexpr int kNewtonSteps = 30;
constexpr std::size_t kMostTouched = 32; // facets about the two ends of a chord

std::uint64_t bit_in_reports(const Scene& scene, const SceneSurface& surface) {
    return felt_bit(static_cast<std::size_t>(&surface - scene.surfaces().data()));
}

} // namespace

Vec3 level_foot(FieldSampler& sampler, const Vec3& point, double level, double longest_step_m) {
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
    return x;
}

double level_distance(FieldSampler& sampler, const Vec3& point, double level,
                      double longest_step_m) {
    const double distance = glm::length(point - level_foot(sampler, point, level, longest_step_m));
    return sampler.value(point) >= level ? distance : -distance;
}

std::optional<FeltSphere> FeltSphere::of(const VolumeDescription& volume, double level) {
    const double outwards = volume.analytic == "sphere_cavity"  ? 1.0
                            : volume.analytic == "solid_sphere" ? -1.0
                                                                : 0.0;
    if (outwards == 0.0) return {};
    return FeltSphere{1e-3 * volume.parameters.at("radius_mm") + outwards * level, outwards};
}

SurfaceAudit::SurfaceAudit(const Scene& scene, const SceneSurface& surface)
    : surface_(surface), place_(scene, surface), bit_(bit_in_reports(scene, surface)) {
    const auto& volumes = scene.description().volumes;
    const auto volume = volumes.find(scene.description().surfaces.at(surface.name).volume);
    // A surface that yields is not where the formula says, and what draws the proxy along it leads
    // it away from the nearest point.
    if (volume != volumes.end() && std::isinf(surface.level.strength_n) && only_surfaces_act(scene))
        sphere_ = FeltSphere::of(volume->second, surface.level.level);
    if (surface.is_felt_by_mesh()) return;
    scale_ = LevelScale::of(*surface.baked.field, surface.level);
    sampler_ = surface.baked.field->make_sampler();
}

void SurfaceAudit::add(const FrameReport& frame, std::span<const Vec3> path) {
    if (bit_ == 0) return; // whether such a surface is felt, or open, no frame says
    if (frame.surfaces_guarded & bit_) add_guarded(frame);
    if (!is_computed(frame.flags) || (frame.surfaces_open & bit_)) return;
    if (!place_.has_path()) path = {};
    const std::optional<Vec3> place = place_.of(frame);
    if (!place) return;
    if (surface_.is_felt_by_mesh())
        add_to_mesh(frame, *place, path);
    else
        add_to_level(frame, *place, path);
}

void SurfaceAudit::add_guarded(const FrameReport& frame) {
    const bool goes_on = guarded_frames_ > 0 && frame.trial == last_guarded_trial_ &&
                         frame.frame - last_guarded_ < kEventGap;
    ++guarded_frames_;
    if (!goes_on) ++guarded_events_;
    last_guarded_ = frame.frame;
    last_guarded_trial_ = frame.trial;
}

void SurfaceAudit::add_to_mesh(const FrameReport& frame, const Vec3& place,
                               std::span<const Vec3> path) {
    for (std::size_t i = 1; i < path.size(); ++i)
        if (passes_through(path[i - 1], path[i])) ++chords_through_;
    if (!(frame.surfaces_felt & bit_)) return;
    if (const auto near = surface_.mesh.scene->closest_point(place, kSearchRadius))
        mesh_distance_m_.push_back(near->distance_m);
    add_position(frame, place);
}

/// A chord may begin or end on a facet, or slide along some: these say nothing, and what is behind
/// them is looked at.
bool SurfaceAudit::passes_through(const Vec3& from, const Vec3& to) const {
    const double skin = surface_.mesh.certified->skin_m();
    std::vector<std::uint32_t> touched;
    while (touched.size() < kMostTouched) {
        const auto hit = surface_.mesh.scene->first_hit(from, to, {touched, {}});
        if (!hit) return false;
        const double before = glm::dot(from - hit->position, hit->normal);
        const double after = glm::dot(to - hit->position, hit->normal);
        if (std::min(std::abs(before), std::abs(after)) > skin) return before * after < 0.0;
        touched.push_back(hit->triangle);
    }
    return false;
}

void SurfaceAudit::add_to_level(const FrameReport& frame, const Vec3& place,
                                std::span<const Vec3> path) {
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
    if (sampler_->value(place) > surface_.level.level + scale_.certificate) ++frames_inside_;
    // What is felt of a texture is in front of the level.
    if (!(frame.surfaces_felt & bit_) || !surface_.texture.none()) return;
    const double distance = level_distance(*sampler_, place, surface_.level.level, scale_.trust_m);
    level_distance_m_.push_back(distance);
    add_position(frame, place);
}

void SurfaceAudit::add_position(const FrameReport& frame, const Vec3& place) {
    if (sphere_ && place_.has_path() && frame.surfaces_felt == bit_) // no other one holds it, too
        position_error_m_.push_back(glm::length(place - sphere_->nearest(frame.probe)));
}

std::string guard_warning(const SurfaceAudit& audit) {
    if (audit.guarded_frames() == 0) return {};
    return fmt::format("the mesh of surface {} held the proxy back in {} frames, {} events: its "
                       "volume would have let it through; the scan is ambiguous there",
                       audit.surface().name, audit.guarded_frames(), audit.guarded_events());
}

SurfaceAudit::Deepest SurfaceAudit::deepest() const {
    Deepest result = deepest_;
    if (result.above_level <= 0.0) return result;
    std::optional<SurfaceHit> hit;
    // From far behind, where only an uncertified proxy gets, the slope does not lead out any more.
    if (surface_.contact == ContactKind::direct)
        hit = surface_.mesh.scene->closest_point(deepest_at_, kSearchRadius);
    result.depth_m = hit ? hit->distance_m
                         : std::abs(level_distance(*sampler_, deepest_at_, surface_.level.level,
                                                   scale_.trust_m));
    return result;
}

} // namespace palpate
