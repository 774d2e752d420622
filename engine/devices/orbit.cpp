// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/devices/orbit.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>

#include <palpate/engine/devices/internal/surface_walk.h>
#include <palpate/engine/scene/internal/scene_ranges.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/haptics/contact/mesh_contact.h>
#include <palpate/haptics/contact/volume_contact.h>

namespace palpate {
namespace {

using internal::SurfaceWalk;
using internal::TouchPlace;

constexpr double kSample = 0.25e-3; // m along the spiral between rays: finer than voxels
constexpr double kGap = 1.5e-3;    // m between places of two rays, beyond which they are not of one
                                   // stretch: six times a sample, a slope of 80 degrees
constexpr double kShortest = 2e-3; // m of a stretch that is worth a trial
constexpr double kDepthWave = 30e-3; // m along the spiral from shallow to deep and back
constexpr double kMargin = 0.01;     // of a mesh's bounds, so that rays begin beyond it; and of a
                                     // way to a facet, so that rounding does not end it short
constexpr double kApproach = 5e-3;   // m in front of the surface where a trial begins at least
constexpr double kFacetReach =
    1e-3;                       // m from a point of a mesh within which its facet is looked for
constexpr int kTries = 6;       // to find how many turns there is time for
constexpr double kFilled = 0.9; // of the time, with which one is content

/// Directions of the spiral: from the pole over the equator to the other pole.
Vec3 spiral_direction(double share, int turns) {
    const double z = 1.0 - 2.0 * share; // equal areas per share
    const double around = 2.0 * std::numbers::pi * turns * share;
    const double r = std::sqrt(std::max(0.0, 1.0 - z * z));
    return {r * std::cos(around), r * std::sin(around), z};
}

/// A part of the spiral on which the surface goes on from ray to ray.
struct Stretch {
    std::vector<TouchPlace> places;
    std::size_t first_ray = 0;
};

/// The spiral around a target, on its surface.
struct Spiral {
    Vec3 center{0.0};
    double reach = 0.0;     // m from the centre, beyond the bounds
    bool is_cavity = false; // felt from the centre outwards
    std::size_t rays = 0;
    std::vector<Stretch> stretches;
};

double depth_at(double along_m, const DeviceDescription& orbit) {
    const double phase = 2.0 * std::numbers::pi * along_m / kDepthWave;
    return 1e-3 * (orbit.depth_min_mm +
                   0.5 * (orbit.depth_max_mm - orbit.depth_min_mm) * (1.0 - std::cos(phase)));
}

double length_of(const std::vector<TouchPlace>& places) {
    double length = 0.0;
    for (std::size_t i = 1; i < places.size(); ++i)
        length += glm::distance(places[i - 1].point, places[i].point);
    return length;
}

Spiral find_spiral(const OrbitTarget& target, const DeviceDescription& orbit, int turns) {
    Spiral spiral;
    spiral.center = target.bounds.center();
    spiral.reach = 0.5 * glm::length(target.bounds.extent());
    spiral.is_cavity =
        target.inside(spiral.center + Vec3{spiral.reach, 0, 0}) && !target.inside(spiral.center);
    // Length of the spiral on a sphere that fills the bounds, about 4 R per turn.
    const auto count = static_cast<std::size_t>(4.0 * turns * spiral.reach / kSample) + 1;
    spiral.rays = count;
    bool is_one_hit = false, is_new = true;
    for (std::size_t i = 0; i < count; ++i) {
        const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(count);
        const Vec3 outside = spiral.center + spiral.reach * spiral_direction(share, turns);
        const Vec3 from = spiral.is_cavity ? spiral.center : outside;
        const Vec3 to = spiral.is_cavity ? outside : spiral.center;
        TouchPlace place;
        if (const std::optional<double> met = target.first_crossing(from, to)) {
            is_one_hit = true;
            place.point = from + *met * (to - from);
            place.normal = target.normal(place.point);
            place.depth_m = depth_at(static_cast<double>(i) * kSample, orbit);
        }
        if (place.normal == Vec3{0.0}) { // nothing met, or nothing that has a side
            is_new = true;
            continue;
        }
        if (!is_new &&
            glm::distance(spiral.stretches.back().places.back().point, place.point) > kGap)
            is_new = true;
        if (std::exchange(is_new, false)) spiral.stretches.push_back({{}, i});
        spiral.stretches.back().places.push_back(place);
    }
    if (!is_one_hit)
        throw std::runtime_error("orbit: no ray around the middle of the surface's bounds meets "
                                 "it; give a path instead");
    std::erase_if(spiral.stretches,
                  [](const Stretch& s) { return length_of(s.places) < kShortest; });
    if (spiral.stretches.empty())
        throw std::runtime_error("orbit: the rays around the middle of the surface's bounds meet "
                                 "nothing that is longer than 2 mm; give a path instead");
    return spiral;
}

/// Where a trial begins, on the ray through a place: the ray is free up to there.
Vec3 in_front_of(const TouchPlace& place, const Spiral& spiral,
                 const std::function<bool(const Vec3&)>& is_free) {
    const Vec3 ray = place.point - spiral.center;
    const double radius = glm::length(ray);
    const Vec3 away = spiral.is_cavity ? -ray / radius : ray / radius;
    const double longest = spiral.is_cavity ? radius : 2.0 * spiral.reach;
    double distance = std::min(kApproach, longest);
    // Through what else is felt, from where nothing is.
    while (is_free && distance < longest && !is_free(place.point + distance * away))
        distance = std::min(2.0 * distance, longest);
    return place.point + distance * away;
}

/// The states of a spiral, up to so many.
Orbit walked(const OrbitTarget& target, const DeviceDescription& orbit, double rate_hz, int turns,
             std::size_t most, const std::function<bool(const Vec3&)>& is_free) {
    const Spiral spiral = find_spiral(target, orbit, turns);
    SurfaceWalk walk({orbit.speed_m_per_s, rate_hz, most,
                      [&](const TouchPlace& place) { return in_front_of(place, spiral, is_free); }},
                     internal::follower_of(target));
    Orbit result;
    result.turns = turns;
    for (const Stretch& stretch : spiral.stretches) {
        const std::size_t done = walk.add(internal::with_smooth_normals(stretch.places));
        if (done == stretch.places.size()) continue;
        result.spiral_share =
            static_cast<double>(stretch.first_ray + done) / static_cast<double>(spiral.rays);
        break;
    }
    result.states = walk.take();
    return result;
}

/// A contact with a surface that never yields.
std::unique_ptr<SurfaceContact> hard_contact(const SceneSurface& surface) {
    if (surface.is_felt_by_mesh())
        return std::make_unique<MeshContact>(surface.mesh.certified, MeshContactSettings{});
    LevelSettings hard = surface.level;
    hard.strength_n = std::numeric_limits<double>::infinity();
    return std::make_unique<VolumeContact>(surface.baked.field, hard);
}

} // namespace

OrbitTarget orbit_target(const ScalarField& field, double level) {
    const std::shared_ptr<FieldSampler> sampler = field.make_sampler();
    const auto normal = [sampler](const Vec3& point) {
        const Vec3 gradient = sampler->sample(point).gradient;
        const double length = glm::length(gradient);
        return length > 0.0 ? -gradient / length : Vec3{0.0};
    };
    return {field.bounds_at(level),
            [sampler, level](const Vec3& from, const Vec3& to) {
                return sampler->first_root(from, to, level);
            },
            [sampler, level](const Vec3& point) { return sampler->value(point) >= level; }, normal};
}

OrbitTarget orbit_target(const SurfaceScene& mesh) {
    Box bounds;
    for (const Vec3& vertex : mesh.mesh().vertices)
        bounds.add(vertex);
    const Vec3 margin = kMargin * bounds.extent();
    const auto first_crossing = [&mesh](const Vec3& from, const Vec3& to) -> std::optional<double> {
        const std::optional<SurfaceHit> hit = mesh.first_hit(from, to);
        if (!hit) return std::nullopt;
        return std::min(1.0, hit->distance_m / glm::length(to - from));
    };
    // Nothing is between a point and the facet that it sees: they are on the same side of it.
    const auto inside = [&mesh, bounds](const Vec3& point) {
        const double farthest =
            glm::length(point - bounds.center()) + 0.5 * glm::length(bounds.extent());
        const auto near = mesh.closest_point(point, farthest);
        if (!near) return false;
        const auto& triangle = mesh.mesh().triangles[near->triangle];
        const auto& vertices = mesh.mesh().vertices;
        const Vec3 centroid =
            (vertices[triangle[0]] + vertices[triangle[1]] + vertices[triangle[2]]) / 3.0;
        const auto seen = mesh.first_hit(point, centroid + kMargin * (centroid - point));
        return seen && glm::dot(point - seen->position, seen->normal) < 0.0;
    };
    const auto normal = [&mesh](const Vec3& point) {
        const std::optional<SurfaceHit> facet = mesh.closest_point(point, kFacetReach);
        return facet ? facet->normal : Vec3{0.0};
    };
    return {{bounds.lower - margin, bounds.upper + margin}, first_crossing, inside, normal};
}

OrbitTarget orbit_target(const SceneSurface& surface) {
    OrbitTarget target = surface.is_felt_by_mesh()
                             ? orbit_target(*surface.mesh.scene)
                             : orbit_target(*surface.baked.field, surface.level.level);
    target.make_contacts = [&surface] {
        std::vector<std::unique_ptr<SurfaceContact>> contacts;
        contacts.push_back(hard_contact(surface));
        return contacts;
    };
    return target;
}

OrbitTarget orbit_target(const Scene& scene, const SceneSurface& surface) {
    OrbitTarget target = orbit_target(surface);
    target.stiffness_n_per_m = scene.description().coupling.stiffness_n_per_m;
    target.surface = static_cast<std::size_t>(&surface - scene.surfaces().data());
    for (const SceneSurface& one : scene.surfaces())
        target.softness.push_back(scene.description().surfaces.at(one.name).softness);
    target.make_contacts = [&scene, &surface] {
        std::vector<std::unique_ptr<SurfaceContact>> contacts;
        for (const SceneSurface& one : scene.surfaces())
            contacts.push_back(&one == &surface ? hard_contact(one) : scene.make_contact(one));
        return contacts;
    };
    return target;
}

Orbit find_orbit(const OrbitTarget& target, const DeviceDescription& orbit, double rate_hz,
                 const std::function<bool(const Vec3& point)>& is_free) {
    const auto most = static_cast<std::size_t>(orbit.duration_s * rate_hz);
    const auto with = [&](int turns, std::size_t frames) {
        return walked(target, orbit, rate_hz, turns, frames, is_free);
    };
    if (orbit.turns > 0) return with(orbit.turns, most);

    // How long a turn takes depends on the surface: tried, from a body that fills half its bounds.
    const double reach = 0.5 * glm::length(target.bounds.extent());
    const double guess = orbit.speed_m_per_s * orbit.duration_s / (2.0 * reach);
    int turns = static_cast<int>(std::clamp(guess, 1.0, 1.0 * internal::kOrbitTurns.high));
    std::optional<Orbit> best;
    int too_many = internal::kOrbitTurns.high + 1;
    for (int tries = 0; tries < kTries; ++tries) {
        Orbit one = with(turns, most);
        // Of the time: what it takes, or would take.
        const double share = one.spiral_share < 1.0 ? 1.0 / std::max(one.spiral_share, 0.01)
                                                    : static_cast<double>(one.states.size()) /
                                                          static_cast<double>(most);
        if (one.spiral_share < 1.0) {
            too_many = turns;
            if (turns == 1) return one;
        } else if (!best || turns > best->turns) {
            best = std::move(one);
            if (share > kFilled) break;
        }
        const int fewest = best ? best->turns + 1 : 1;
        if (fewest >= too_many) break;
        turns = static_cast<int>(std::clamp(turns / share, 1.0 * fewest, too_many - 1.0));
    }
    return best ? std::move(*best) : with(1, most);
}

std::vector<DeviceState> make_orbit(const OrbitTarget& target, const DeviceDescription& orbit,
                                    double rate_hz) {
    return find_orbit(target, orbit, rate_hz).states;
}

std::vector<DeviceState> make_orbit(const ScalarField& field, double level,
                                    const DeviceDescription& orbit, double rate_hz) {
    OrbitTarget target = orbit_target(field, level);
    const std::shared_ptr<const ScalarField> borrowed(std::shared_ptr<void>{}, &field);
    target.make_contacts = [borrowed, level] {
        LevelSettings settings;
        settings.level = level;
        std::vector<std::unique_ptr<SurfaceContact>> contacts;
        contacts.push_back(std::make_unique<VolumeContact>(borrowed, settings));
        return contacts;
    };
    return make_orbit(target, orbit, rate_hz);
}

} // namespace palpate
