// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/haptics/contact/softness.h>
#include <palpate/volume/scalar_field.h>

namespace palpate {

class SurfaceContact;

/// What a generated path asks of the surface that it leads over. Not for two threads at once.
struct OrbitTarget {
    Box bounds; ///< m, scene frame; the surface is within
    /// Share of the way from -> to at which the surface is first met, [0,1]; nothing where it is
    /// not.
    std::function<std::optional<double>(const Vec3& from, const Vec3& to)> first_crossing;
    std::function<bool(const Vec3& point)> inside; ///< in the material, not in free space
    /// Unit normal towards free space at a point of the surface; zero where there is none.
    std::function<Vec3(const Vec3& point)> normal;
    /// Contacts with all that holds a proxy there, itself without yielding; empty where there are
    /// none: then nobody knows where the path's probe would be held.
    std::function<std::vector<std::unique_ptr<SurfaceContact>>()> make_contacts = {};
    /// How soft each of these contacts is, for where a soft surface's front goes; empty: all hard.
    std::vector<Softness> softness = {};
    std::size_t surface = 0;          ///< that the path leads over, among these contacts
    double stiffness_n_per_m = 500.0; ///< of the coupling: what others of them yield by
};

/// The level of a field: the first root. The field must outlive the target.              [setup]
OrbitTarget orbit_target(const ScalarField& field, double level);

/// A mesh: the first facet; inside is what lies behind the facet that is seen from a point. Right
/// for closed meshes that are oriented towards free space, but for points that see an edge. The
/// mesh must outlive the target.  [setup]
OrbitTarget orbit_target(const SurfaceScene& mesh);

/// What is felt of a surface: its mesh for contact `mesh`, else its level. It must outlive the
/// target.                                                                               [setup]
OrbitTarget orbit_target(const SceneSurface& surface);

/// The same among the other surfaces of its scene, which hold the proxy as well.         [setup]
OrbitTarget orbit_target(const Scene& scene, const SceneSurface& surface);

/// A probe path that sweeps over a surface from its free side and presses into it: a spiral from
/// pole to pole around the centre of the target's bounds, on the first crossing from outside along
/// each ray (from the centre outwards where the centre is free and the outside is not: a cavity),
/// and from there along the surface's normal to a depth that swings between depth_min_mm and
/// depth_max_mm. A proxy that follows it is never farther from the probe than that (SurfaceWalk).
/// Each stretch of surface that the rays see without a gap is a trial of its own, which begins in
/// free space. Speed along the path is speed_m_per_s.
struct Orbit {
    std::vector<DeviceState> states; ///< a frame each, scene frame, m, s
    int turns = 0;                   ///< of the spiral
    double spiral_share = 1.0;       ///< of it that was gone before the time was over
};

/// An orbit of at most duration_s. With turns = 0 as many turns as that leaves time for, at least
/// one; `is_free` says where a trial may begin, everywhere in front of the surface where it is
/// empty. [setup] Throws std::runtime_error when no ray meets the surface.
Orbit find_orbit(const OrbitTarget& target, const DeviceDescription& orbit, double rate_hz,
                 const std::function<bool(const Vec3& point)>& is_free = {});

/// The states of find_orbit().                                                          [setup]
std::vector<DeviceState> make_orbit(const OrbitTarget& target, const DeviceDescription& orbit,
                                    double rate_hz);

/// The same around the level of a field.                                                [setup]
std::vector<DeviceState> make_orbit(const ScalarField& field, double level,
                                    const DeviceDescription& orbit, double rate_hz);

} // namespace palpate
