// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/run/internal/felt_places.h>

#include <algorithm>
#include <cstddef>
#include <stdexcept>

#include <palpate/engine/devices/orbit.h>
#include <palpate/engine/scene/internal/effect_questions.h>
#include <palpate/engine/scene/scene_surface.h>

namespace palpate::internal {
namespace {

constexpr std::size_t kPlaces = 2000;
constexpr double kSpeed = 0.2;          // m/s
constexpr double kStep = 1e-3 * kSpeed; // m between two places
constexpr std::size_t kStroke = 10;     // steps of a hand that goes to and fro
constexpr int kTries = 16;              // along each axis of a volume
constexpr double kDepthInside_mm = 1.0; // behind a surface's certificate

bool is_felt(Effect& effect, const Vec3& from) {
    PrimitiveSet primitives;
    effect.restart(from); // one that goes along begins where the last frame ended
    effect.begin(frame_from(from, from + Vec3{kStep, 0.0, 0.0}));
    effect.gather(from, primitives);
    return !primitives.is_free() || primitives.force() != Vec3{0.0} ||
           primitives.total_stiffness(0.0) > 0.0;
}

} // namespace

FrameContext frame_from(const Vec3& from, const Vec3& to) noexcept { return {to, from}; }

namespace {

/// To and fro about a place, along x.
std::vector<Vec3> places_about(const Vec3& place) {
    std::vector<Vec3> places;
    for (std::size_t i = 0; i < kPlaces; ++i) {
        const std::size_t phase = i % (2 * kStroke);
        const auto steps = static_cast<double>(std::min(phase, 2 * kStroke - phase));
        places.push_back(place + Vec3{(steps - 0.5 * kStroke) * kStep, 0.0, 0.0});
    }
    return places;
}

/// The middle of a box, and a lattice in it.
std::vector<Vec3> places_in(const Box& box) {
    std::vector<Vec3> places{box.center()};
    for (int i = 0; i < kTries; ++i)
        for (int j = 0; j < kTries; ++j)
            for (int k = 0; k < kTries; ++k)
                places.push_back(box.lower + (Vec3(i, j, k) + 0.5) / static_cast<double>(kTries) *
                                                 box.extent());
    return places;
}

/// Where to look for an effect.
std::vector<Vec3> candidates(const Scene& scene, const EffectDescription& effect) {
    if (std::vector<Vec3> places = places_of(effect); !places.empty()) return places;
    if (const std::optional<Box> bounds = scene.effect_bounds(volume_of(effect)))
        return places_in(*bounds);
    return {Vec3{0.0}};
}

} // namespace

std::vector<Vec3> places_on(const SceneSurface& surface, double depth_mm) {
    std::vector<Vec3> places;
    DeviceDescription orbit;
    orbit.depth_min_mm = orbit.depth_max_mm = depth_mm;
    orbit.speed_m_per_s = kSpeed;
    orbit.turns = 12;
    orbit.duration_s = kPlaces / 1000.0 + 0.5;
    try {
        for (const DeviceState& state : make_orbit(orbit_target(surface), orbit, 1000.0))
            places.push_back(state.position);
    } catch (const std::runtime_error&) {
        places.clear();
    }
    return places;
}

std::vector<Vec3> places_where_felt(const Scene& scene, const EffectDescription& effect,
                                    Effect& built) {
    std::vector<Vec3> places;
    for (const SceneSurface& surface : scene.surfaces())
        if (surface.name == surface_of(effect)) places = places_on(surface, kDepthInside_mm);
    if (places.empty()) {
        const std::vector<Vec3> tried = candidates(scene, effect);
        const auto found = std::find_if(tried.begin(), tried.end(),
                                        [&](const Vec3& place) { return is_felt(built, place); });
        places = places_about(found == tried.end() ? tried.front() : *found);
    }
    std::vector<Vec3> felt;
    std::copy_if(places.begin(), places.end(), std::back_inserter(felt),
                 [&](const Vec3& place) { return is_felt(built, place); });
    return felt.empty() ? places : felt;
}

} // namespace palpate::internal
