// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <palpate/volume/volume_parts.h>
#include <palpate/volume/volume_settings.h>
#include <palpate/volume/voxel_volume.h>

/// What is baked into a field before a surface is taken from it, so that mesh and volume are of the
/// same thing.
namespace palpate {

/// A copy with `margin` voxels of `background` around it; the affine follows, so voxels keep their
/// places.        [setup]
VoxelVolume padded(const VoxelVolume& volume, int margin, float background);

/// The voxels whose cells meet the box `region_m` (scene frame), with their places.      [setup]
/// Throws std::invalid_argument where the volume has none there, saying where it is.
VoxelVolume cropped(const VoxelVolume& volume, const Box& region_m);

/// Sets blocks of 8 x 8 x 8 voxels (aligned with index 0, as OpenVDB's leaves) to `background`
/// where no voxel of the block or within three of it reaches the level: a sparse grid then keeps
/// only what a surface needs, its stencils included.                                     [setup]
void clear_far_from_level(VoxelVolume& volume, double level, float background);

/// Gaussian of standard deviation `sigma_voxels` ([0, 25]; along each axis in its own spacing; 0 =
/// unchanged). The border's values go on outside. NaN spreads over the kernel, about 4 sigma. Bits
/// do not depend on the number of threads.  [setup]
void smooth(VoxelVolume& volume, double sigma_voxels);

/// Shift of the surface smoothed = smoothed_level against original = original_level, averaged over
/// the latter's area. Of more than 200 000 points a regular subset. Both of one size and place,
/// with free space around (padded()); else std::invalid_argument. No surface: all 0. [setup]
SurfaceShift surface_shift(const VoxelVolume& original, double original_level,
                           const VoxelVolume& smoothed, double smoothed_level);

/// A level, and how far its surface then lies from the original one.
struct KeptLevel {
    double level = 0.0; ///< in the unit of the values
    SurfaceShift shift; ///< as surface_shift() tells it
};

/// The level of `smoothed` whose surface does not move on average against `original` at
/// `original_level` (contact.md 5): |surface_shift| <= 1e-6 m. Where points of a small surface
/// vanish from one level to the next, so that the mean jumps over 0: the side nearer to 0, if
/// within a hundredth of a voxel.                               [setup] Throws std::runtime_error
/// when no level does that.
KeptLevel level_keeping_position(const VoxelVolume& original, double original_level,
                                 const VoxelVolume& smoothed);

/// Labels voxels >= level with 26-connectivity and sets those of unwanted components to level -
/// margin: all eight corners of every cell around them are then below the level, so no root is left
/// (contact.md 1.1). Largest first.           [setup]
std::vector<VolumeComponent> remove_components(VoxelVolume& volume, double level,
                                               const ComponentPolicy& policy, double margin);

} // namespace palpate
