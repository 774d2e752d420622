// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <palpate/volume/label_volume.h>
#include <palpate/volume/volume_parts.h>
#include <palpate/volume/voxel_volume.h>

/// A label's occupancy (1 inside, 0 outside) becomes a smooth surface without losing volume, and
/// without opening gaps to its neighbours.
namespace palpate {

/// A smoothed occupancy of the chosen labels in which neighbours go on meeting:          [setup]
///     g = f / (f + (sum over others o of f_o^4)^(1/4))
/// where f is the Gaussian of the chosen labels' occupancy and f_o that of each other label of
/// their layers, and of the background. Between two of them it is the Gaussian itself, g = f. Where
/// more meet, and in a sheet between two bodies, every plain Gaussian falls below one half and
/// would leave nobody's land; there g stays near one half. `occupancy`: label_occupancy() of the
/// chosen labels, or a part of it; its margin is to hold the kernel, 4 sigma + 2 voxels.
/// sigma_voxels as in smooth(); 0 = unchanged. Throws std::invalid_argument as smooth(), and where
/// the occupancy's voxels are not the volume's.
VoxelVolume smooth_against_neighbours(const LabelVolume& volume,
                                      std::span<const std::size_t> chosen,
                                      const VoxelVolume& occupancy, double sigma_voxels);

/// The smoothed occupancy of the chosen labels without a groove along the border to others of
/// `joined`:                                                                              [setup]
///     min(u, g / kGrooveReach)
/// where g is `smoothed`, what smooth_against_neighbours() made of the chosen ones, and u what it
/// makes of all of `joined` together. Two bodies that touch meet at a groove without a bottom: near
/// it their two levels are tangent, and no grid resolves what lies between. u has no groove there.
/// So the chosen labels end at the level of u wherever g is at least kGrooveReach times the level:
/// about a sigma into their neighbours. Each of the neighbours does the same, so along the border
/// both have the same surface. Where no other label of `joined` is near, g itself, bit for bit.
/// `joined` holds the chosen ones, too. Throws std::invalid_argument as
/// smooth_against_neighbours().
VoxelVolume without_grooves(const LabelVolume& volume, std::span<const std::size_t> chosen,
                            std::span<const std::size_t> joined, const VoxelVolume& smoothed,
                            double sigma_voxels);

/// How far labels reach over their neighbours in without_grooves(): to this share of their level.
/// On the outside, over the border between two labels, g is 0.33, over an edge of three 0.25: at
/// levels near one half both lie well within the reach.
inline constexpr double kGrooveReach = 0.3;

/// Volume in m3 where the trilinear interpolation of `volume` is >= level, between its voxel
/// centres: its surface is closed where the border is below the level.                   [setup]
/// Exact where the level lies flat in its cells; of a ball of 4 voxels' radius within 1e-3, larger
/// ones better. A voxel that is not finite counts as the lowest value, as a grid takes it.
double volume_above(const VoxelVolume& volume, double level);

/// The level of a smoothed occupancy that encloses `volume_m3`, to 1e-4 of it.          [setup]
/// Throws std::runtime_error when no level in (0, 1) does.
double level_keeping_volume(const VoxelVolume& smoothed, double volume_m3);

/// Parts of `occupancy` that lie more than half a voxel outside the surface smoothed = level: what
/// smoothing took away and not just rounded off. Half a voxel is meant along each axis in its own
/// spacing, looked for along the 26 directions to a voxel's neighbours; a part is a set of such
/// voxels that touch, corners included. Largest first; parts of fewer than `smallest` voxels are
/// left out: a box loses the voxels at its corners.                                       [setup]
/// Both of one size and place; else std::invalid_argument.
std::vector<ThinPart> thin_parts(const VoxelVolume& occupancy, const VoxelVolume& smoothed,
                                 double level, std::size_t smallest = 4);

} // namespace palpate
