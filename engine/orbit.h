// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/scene_description.h>
#include <palpate/volume/scalar_field.h>

namespace palpate {

/// A probe path that sweeps over a surface from its free side and presses into it: a spiral from
/// pole to pole around the centre of the field's bounds, on the first root from outside along each
/// ray (from the centre outwards where the centre is free and the outside is not: a cavity), minus
/// a depth that swings between depth_min_mm and depth_max_mm. Where the surface falls away faster
/// than one to one the path stays above it, so that no point is deeper than depth_max_mm below the
/// first root. Begins in free space; each longer stretch of it begins a new trial, which brings
/// back a proxy that was left behind in a pocket and changes nothing for one that follows. Speed
/// along the path is speed_m_per_s; ends with the spiral or duration_s, whichever comes first.
/// [setup] Throws std::runtime_error when no ray meets the surface.
std::vector<DeviceState> make_orbit(const ScalarField& field, double level,
                                    const DeviceDescription& orbit, double rate_hz);

} // namespace palpate
