// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/geometry/triangle_mesh.h>
#include <palpate/volume/label_volume.h>
#include <palpate/volume/voxel_volume.h>

namespace palpate::internal {

/// Most voxels that a picture's surface is taken from: 256 cubed, more than its pixels show.
inline constexpr std::size_t kPreviewVoxels = std::size_t{1} << 24;

/// The isosurface of a volume, as good as a picture needs: a volume of more than `most` voxels is
/// averaged in blocks first, so that no copy of a large one is made.                     [setup]
/// Throws std::invalid_argument unless the level lies between the smallest and the largest value.
TriangleMesh preview_surface(const VoxelVolume& volume, double level,
                             std::size_t most = kPreviewVoxels);

/// The border of all labels together, smoothed by a voxel, likewise; where nothing is thick enough
/// for that, as the voxels are. Empty without labels.                                   [setup]
TriangleMesh preview_surface(const LabelVolume& volume, std::size_t most = kPreviewVoxels);

} // namespace palpate::internal
