// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/orbit.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace palpate {
namespace {

constexpr double kSample = 0.25e-3; // m along the spiral between rays: finer than voxels
constexpr double kSteepest =
    1.0; // radius change per arc length that the probe follows: not into deep pockets
constexpr int kFreeFrames = 20;      // in free space, after which a new trial begins
constexpr double kDepthWave = 30e-3; // m along the spiral from shallow to deep and back
constexpr double kMargin = 0.01;   // of a mesh's bounds, so that rays begin beyond it; and of a way
                                   // to a facet, so that rounding does not end it short
constexpr double kApproach = 5e-3; // m in front of the surface where the path begins
constexpr double kMissedShare =
    0.3; // of the largest radius: where rays that meet nothing put the surface

/// Directions of the spiral: from the pole over the equator to the other pole.
Vec3 spiral_direction(double share, int turns) {
    const double z = 1.0 - 2.0 * share; // equal areas per share
    const double around = 2.0 * std::numbers::pi * turns * share;
    const double r = std::sqrt(std::max(0.0, 1.0 - z * z));
    return {r * std::cos(around), r * std::sin(around), z};
}

/// Where rays meet the surface, as a radius over the spiral's samples.
struct Profile {
    std::vector<Vec3> direction;
    std::vector<double> radius; // m from the centre; negative where a ray meets nothing
    bool cavity = false;        // felt from the centre outwards
    double mean_radius = 0.0;
};

Profile cast_rays(const OrbitTarget& target, const Vec3& center, double reach, int turns) {
    Profile profile;
    profile.cavity = target.inside(center + Vec3{reach, 0, 0}) && !target.inside(center);
    // Length of the spiral on a sphere that fills the bounds, about 4 R per turn.
    const double length = 4.0 * turns * reach;
    const std::size_t count = static_cast<std::size_t>(length / kSample) + 1;
    std::size_t hits = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const Vec3 direction = spiral_direction((i + 0.5) / count, turns);
        const Vec3 outside = center + reach * direction;
        const std::optional<double> share = profile.cavity ? target.first_crossing(center, outside)
                                                           : target.first_crossing(outside, center);
        profile.direction.push_back(direction);
        profile.radius.push_back(!share           ? -1.0
                                 : profile.cavity ? *share * reach
                                                  : (1.0 - *share) * reach);
        if (!share) continue;
        ++hits;
        profile.mean_radius += profile.radius.back();
    }
    if (hits == 0)
        throw std::runtime_error("orbit: no ray around the middle of the surface's bounds meets "
                                 "it; give a path instead");
    profile.mean_radius /= static_cast<double>(hits);
    return profile;
}

/// Presses the depth into the profile and takes the steepness out, towards free space, so that
/// nothing becomes deeper.
void press(Profile& profile, const DeviceDescription& orbit) {
    const double towards_free = profile.cavity ? -1.0 : 1.0;
    const double missed =
        kMissedShare * *std::max_element(profile.radius.begin(), profile.radius.end());
    const double low = 1e-3 * orbit.depth_min_mm;
    const double high = 1e-3 * orbit.depth_max_mm;
    std::vector<double>& radius = profile.radius;
    for (std::size_t i = 0; i < radius.size(); ++i) {
        const double phase = 2.0 * std::numbers::pi * (i * kSample) / kDepthWave;
        const double depth = low + 0.5 * (high - low) * (1.0 - std::cos(phase));
        if (radius[i] < 0.0)
            radius[i] = profile.cavity ? profile.mean_radius : missed;
        else
            radius[i] -= towards_free * depth;
    }
    const auto limit = [&](std::size_t to, std::size_t from) {
        const double step = kSteepest * kSample;
        if (towards_free * (radius[from] - radius[to]) > step)
            radius[to] = radius[from] - towards_free * step;
    };
    for (std::size_t i = 1; i < radius.size(); ++i)
        limit(i, i - 1);
    for (std::size_t i = radius.size() - 1; i-- > 0;)
        limit(i, i + 1);
}

std::vector<Vec3> corners(const Profile& profile, const Vec3& center) {
    const double towards_free = profile.cavity ? -1.0 : 1.0;
    std::vector<Vec3> points;
    const double first = profile.radius.front();
    const double start = profile.cavity ? 0.0 : first + towards_free * (kApproach + 0.05);
    points.push_back(center + std::max(start, 0.0) * profile.direction.front());
    for (std::size_t i = 0; i < profile.radius.size(); ++i)
        points.push_back(center + profile.radius[i] * profile.direction[i]);
    return points;
}

} // namespace

OrbitTarget orbit_target(const ScalarField& field, double level) {
    const std::shared_ptr<FieldSampler> sampler = field.make_sampler();
    return {field.bounds(),
            [sampler, level](const Vec3& from, const Vec3& to) {
                return sampler->first_root(from, to, level);
            },
            [sampler, level](const Vec3& point) { return sampler->value(point) >= level; }};
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
    return {{bounds.lower - margin, bounds.upper + margin}, first_crossing, inside};
}

OrbitTarget orbit_target(const SceneSurface& surface) {
    return surface.is_felt_by_mesh() ? orbit_target(*surface.mesh.scene)
                                     : orbit_target(*surface.baked.field, surface.level.level);
}

std::vector<DeviceState> make_orbit(const ScalarField& field, double level,
                                    const DeviceDescription& orbit, double rate_hz) {
    return make_orbit(orbit_target(field, level), orbit, rate_hz);
}

std::vector<DeviceState> make_orbit(const OrbitTarget& target, const DeviceDescription& orbit,
                                    double rate_hz) {
    const Vec3 center = target.bounds.center();
    const double reach = 0.5 * glm::length(target.bounds.extent());
    Profile profile = cast_rays(target, center, reach, orbit.turns);
    press(profile, orbit);
    const std::vector<Vec3> path = corners(profile, center);

    // Walked at constant speed: a state per frame.
    std::vector<DeviceState> states;
    const double step = orbit.speed_m_per_s / rate_hz;
    const auto most = static_cast<std::size_t>(orbit.duration_s * rate_hz);
    int free_frames = 0;
    std::size_t corner = 0;
    double along = 0.0; // of the current edge
    while (corner + 1 < path.size() && states.size() < most) {
        const Vec3 edge = path[corner + 1] - path[corner];
        const double length = glm::length(edge);
        if (along > length) {
            along -= length;
            ++corner;
            continue;
        }
        DeviceState state;
        state.time_s = static_cast<double>(states.size()) / rate_hz;
        state.position = path[corner] + (length > 0.0 ? along / length : 0.0) * edge;
        if (!states.empty()) state.velocity = (state.position - states.back().position) * rate_hz;
        free_frames = target.inside(state.position) ? 0 : free_frames + 1;
        state.trial =
            (states.empty() ? 0 : states.back().trial) + (free_frames == kFreeFrames ? 1 : 0);
        states.push_back(state);
        along += step;
    }
    return states;
}

} // namespace palpate
