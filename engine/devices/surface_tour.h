// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/devices/orbit.h>
#include <palpate/engine/loop/frame_report.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/scene/scene_surface.h>

namespace palpate {

/// The surface that is felt, as a mesh: the one that its contact has, else the level's preview; of
/// a formula, a preview of its level on a grid of 128 nodes within its bounds.           [setup]
std::shared_ptr<const TriangleMesh> mesh_of(const SceneSurface& surface);

/// A probe path over the whole of a surface: along lines of equal distance over the surface from
/// one of its tips, spacing_mm apart, so that every branch is gone around. It presses press_mm deep
/// along the surface's normal, at speed_m_per_s; a proxy that follows it is never farther from the
/// probe than that (SurfaceWalk). Where one line lies beside the next it goes on over the surface,
/// else a new trial begins in free space. The same surface gives the same path. At most so many
/// states.                                                                              [setup]
/// `is_free` says where a trial may begin, everywhere in front of the surface where it is empty.
std::vector<DeviceState> make_tour(std::shared_ptr<const TriangleMesh> mesh,
                                   const OrbitTarget& target, const DeviceDescription& tour,
                                   double rate_hz, std::size_t most_frames,
                                   const std::function<bool(const Vec3& point)>& is_free = {});

/// How much of a surface was felt.
struct SurfaceCoverage {
    std::string surface;     ///< name of the scene
    double area_m2 = 0.0;    ///< of its whole mesh, m2
    double within_m = 0.0;   ///< of a place where it was felt counts as felt
    double felt_share = 0.0; ///< of the area, [0,1]
};

/// Share of a mesh's area within a distance, m, of places where it was felt, m, scene frame.
/// [setup]
SurfaceCoverage coverage_of(const TriangleMesh& mesh, std::span<const Vec3> places,
                            double within_m);

/// Of each surface that the tour of a scene goes to, within its spacing of where frames that felt
/// it were on it; none where its device is no tour, and of surfaces that have no bit.      [setup]
std::vector<SurfaceCoverage> tour_coverage(const Scene& scene, std::span<const FrameReport> frames);

} // namespace palpate
