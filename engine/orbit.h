// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/scene.h>
#include <palpate/geometry/surface_scene.h>
#include <palpate/volume/scalar_field.h>

namespace palpate {

/// What an orbit asks of the surface that it goes around. Not for two threads at once.
struct OrbitTarget {
    Box bounds; ///< m, scene frame; the surface is within
    /// Share of the way from -> to at which the surface is first met, [0,1]; nothing where it is
    /// not.
    std::function<std::optional<double>(const Vec3& from, const Vec3& to)> first_crossing;
    std::function<bool(const Vec3& point)> inside; ///< in the material, not in free space
};

/// The level of a field: the first root. The field must outlive the target.              [setup]
OrbitTarget orbit_target(const ScalarField& field, double level);

/// A mesh: the first facet; inside is what lies behind the facet that is seen from a point. Right
/// for closed meshes that are oriented towards free space, but for points that see an edge. The
/// mesh must outlive the target.  [setup]
OrbitTarget orbit_target(const SurfaceScene& mesh);

/// What is felt of a surface: its mesh for contact `mesh`, else its level.               [setup]
OrbitTarget orbit_target(const SceneSurface& surface);

/// A probe path that sweeps over a surface from its free side and presses into it: a spiral from
/// pole to pole around the centre of the target's bounds, on the first crossing from outside along
/// each ray (from the centre outwards where the centre is free and the outside is not: a cavity),
/// minus a depth that swings between depth_min_mm and depth_max_mm. Where the surface falls away
/// faster than one to one the path stays above it, so that no point is deeper than depth_max_mm
/// below the first crossing. Begins in free space; each longer stretch of it begins a new trial,
/// which brings back a proxy that was left behind in a pocket and changes nothing for one that
/// follows. Speed along the path is speed_m_per_s; ends with the spiral or duration_s, whichever
/// comes first.  [setup] Throws std::runtime_error when no ray meets the surface.
std::vector<DeviceState> make_orbit(const OrbitTarget& target, const DeviceDescription& orbit,
                                    double rate_hz);

/// The same around the level of a field.                                                [setup]
std::vector<DeviceState> make_orbit(const ScalarField& field, double level,
                                    const DeviceDescription& orbit, double rate_hz);

} // namespace palpate
