// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/devices/internal/hand_press.h>

#include <optional>
#include <stdexcept>

#include <fmt/format.h>

#include <palpate/engine/devices/internal/device_surfaces.h>
#include <palpate/engine/devices/orbit.h>
#include <palpate/engine/scene/scene_place.h>
#include <palpate/engine/scene/scene_surface.h>

namespace palpate::internal {
namespace {

constexpr double kDistance_m = 20e-3; // in front of the surface, where it begins and ends
constexpr double kApproach_s = 1.0;

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
    const std::optional<double> met = target.first_crossing(from, to);
    if (!met)
        throw std::runtime_error(
            fmt::format("{}: a hand that comes from {} does not meet surface {}; let "
                        "it come `from` another side",
                        place_of_device(scene.description()),
                        kPatientSideNames[static_cast<std::size_t>(device.from)], surface.name));

    return press_into(from + *met * (to - from), is_cavity ? -side : side, kDistance_m,
                      1e-3 * device.depth_mm, kApproach_s, device.duration_s - 2.0 * kApproach_s);
}

} // namespace palpate::internal
