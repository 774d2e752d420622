// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string_view>

#include <palpate/engine/scene/scene.h>
#include <palpate/geometry/vec.h>

namespace palpate {

/// The point of a surface that is nearest to another one. Scene frame.
struct NearestPoint {
    Vec3 position{0.0};      ///< m, on the surface
    Vec3 normal{0.0};        ///< unit, out of the surface, as the level falls or the facet faces;
                             ///< at an edge or vertex of a mesh: that of one of its facets
    double distance_m = 0.0; ///< from the point; < 0 where that is behind the surface
    bool sign_known = true;  ///< false: a mesh with a border, which has no inside; then the sign
                             ///< is that of the nearest facet's side
};

/// Distances from one surface of a scene, for planning and display: nothing for the loop. What is
/// measured is what the scene names, with no texture, and before anything yielded.
///
/// A surface of a mesh alone is measured exactly: its nearest facet of all, to rounding (1e-15 of
/// the coordinates). Any other is the level of its volume, as interpolated. A nearest point is on
/// it to 1e-11 m, and the line to it is across the level there, or ends at a kink between voxels
/// that holds it. Several ways are tried: along the slope, from 26 points around, and from the mesh
/// or a preview of it where the volume has voxels. So it is the nearest of all where these find its
/// sheet. It is never too near. Not for two threads at once.
class SurfaceDistance {
public:
    /// `surface` is a name of Scene::surfaces(); of voxels without a mesh, a preview is made.
    /// Throws std::invalid_argument that lists the names where there is no such surface. [setup]
    SurfaceDistance(std::shared_ptr<const Scene> scene, std::string_view surface);
    ~SurfaceDistance();
    /// What was moved from may only be destroyed or assigned to.                            [setup]
    SurfaceDistance(SurfaceDistance&&) noexcept;
    /// As the constructor.                                                                  [setup]
    SurfaceDistance& operator=(SurfaceDistance&&) noexcept;

    /// Nothing where the point is no place, or where no way leads to the level within
    /// kReach_m.   [setup]
    std::optional<NearestPoint> nearest(const Vec3& point) const;

    /// How far from a point its surface is looked for, m.
    static constexpr double kReach_m = 1.0;

private:
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

} // namespace palpate
