// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <memory>
#include <string>
#include <vector>

#include <palpate/haptics/choices.h>

#include "tests/support/contact_kinds.h"

/// Wedges and grooves of every angle, felt in every way: how far the proxy gets in, whether
/// something is felt where nothing is, and whether a held probe comes to rest.
namespace palpate::stability {

/// A wedge is a body with an edge; a groove is free space with one.
enum class WedgeShape { wedge, groove };

/// What was measured of one shape, angle, contact and method. Voxels are 0.5 mm, turned against the
/// faces; depths are those into the faces themselves, not into what voxels made of them.
struct WedgeResult {
    double angle_deg = 0.0;     ///< of the body's edge, or of the groove
    double penetration_m = 0.0; ///< deepest place of the proxy's path
    double ghost_n = 0.0;       ///< greatest force with the probe in free space, in sight of the
                                ///< proxy, and a voxel from the body where that is voxels
    double rest_m = 0.0;        ///< the proxy's longest way in a frame, 500 to 600 frames after the
                                ///< probe was stopped
};

inline constexpr double kWedgeVoxel_m = 0.5e-3;
/// Of the guarded ones: less than what voxels lose of an edge, so that the mesh has to hold.
inline constexpr double kWedgeLeash_m = 0.1e-3;
/// How deep the probe is behind a face before it leaves over the edge.
inline constexpr double kWedgePressed_m = 0.2e-3;

/// Where a chord goes through the middle of a wedge or a groove (x = 0), as a share of it: there it
/// is deepest, as both faces are flat. 0 where it does not.
inline double share_at_middle(const Vec3& from, const Vec3& to) {
    return from.x * to.x < 0.0 ? from.x / (from.x - to.x) : 0.0;
}

/// A wedge or a groove along y with its edge at the origin, which holds with this strength, N, > 0.
std::vector<std::unique_ptr<SurfaceContact>> wedge_surfaces(WedgeShape shape, double angle_deg,
                                                            test::Kind kind, double strength_n);

/// One shape, felt one way.
WedgeResult feel_wedge(WedgeShape shape, double angle_deg, test::Kind kind, SteppingMethod method);

/// All angles from 5 to 175 degrees in steps of 5, and what is worst of each number.
WedgeResult worst_wedge(WedgeShape shape, test::Kind kind, SteppingMethod method);

/// The table of docs/stability.md.
void write_wedge_table(std::ostream& out);
/// The same with a row for each angle.
void write_wedges_by_angle(std::ostream& out);

} // namespace palpate::stability
