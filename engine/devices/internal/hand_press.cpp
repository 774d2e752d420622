// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/devices/internal/hand_press.h>

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include <palpate/engine/devices/internal/device_surfaces.h>
#include <palpate/engine/devices/orbit.h>
#include <palpate/engine/scene/scene_place.h>
#include <palpate/engine/scene/scene_surface.h>

namespace palpate::internal {
namespace {

constexpr double kDistance_m = 20e-3; // in front of the surface, where it begins and ends
constexpr double kApproach_s = 1.0;

std::optional<Vec3> met_between(const OrbitTarget& target, const Vec3& from, const Vec3& to) {
    const std::optional<double> share = target.first_crossing(from, to);
    if (!share) return std::nullopt;
    return from + *share * (to - from);
}

/// Of what has nothing in its middle, as two organs have, or a ring: where parallel ways from
/// `side` meet it, the way nearest to the middle.
std::optional<Vec3> met_beside(const OrbitTarget& target, const Vec3& side) {
    constexpr int kWays = 16; // to either side of the middle
    const Vec3 extent = target.bounds.extent();
    const Vec3 half = 0.5 * extent * (Vec3(1.0) - glm::abs(side)); // across
    std::vector<Vec3> ways;
    for (int i = -kWays; i <= kWays; ++i)
        for (int j = -kWays; j <= kWays; ++j) {
            const double u = static_cast<double>(i) / kWays, v = static_cast<double>(j) / kWays;
            const bool along_x = half.x == 0.0, along_y = half.y == 0.0;
            ways.push_back(half * (along_x ? Vec3(0.0, u, v) : Vec3(u, along_y ? 0.0 : v, v)));
        }
    std::stable_sort(ways.begin(), ways.end(), [](const Vec3& a, const Vec3& b) {
        return squared_length(a) < squared_length(b);
    });
    const Vec3 reach = glm::length(extent) * side;
    for (const Vec3& way : ways) {
        const Vec3 middle = target.bounds.center() + way;
        if (const auto met = met_between(target, middle + reach, middle - reach)) return met;
    }
    return std::nullopt;
}

} // namespace

std::vector<HandIntent> press_of(const Scene& scene) {
    const DeviceDescription& device = scene.description().device;
    const SceneSurface& surface = *surfaces_of_device(scene).front();
    const OrbitTarget target = orbit_target(surface);
    const Vec3 center = target.bounds.center();
    const Vec3 side = direction_of(device.from);
    const Vec3 outside = center + glm::length(target.bounds.extent()) * side;
    // Into a body from its side, into the wall of a cavity from its middle.
    const bool is_cavity = !target.inside(center) && target.inside(outside);
    const Vec3 from = is_cavity ? center : outside;
    const Vec3 to = is_cavity ? outside : center;
    std::optional<Vec3> met = met_between(target, from, to);
    if (!met && !is_cavity) met = met_beside(target, side);
    if (!met)
        throw std::runtime_error(
            fmt::format("{}: a hand that comes from {} does not meet surface {}; let "
                        "it come `from` another side",
                        place_of_device(scene.description()),
                        kPatientSideNames[static_cast<std::size_t>(device.from)], surface.name));

    return press_into(*met, is_cavity ? -side : side, kDistance_m, 1e-3 * device.depth_mm,
                      kApproach_s, device.duration_s - 2.0 * kApproach_s);
}

} // namespace palpate::internal
