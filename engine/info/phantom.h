// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/volume/voxel_volume.h>

namespace palpate {

/// A generated CT for tests and for demos without data: a bumpy shell of about 30 mm radius with
/// what makes skulls hard, a wall of 0.6 to 3.8 mm half thickness, a groove, blurred edges (HU: air
/// -1000, bone up to 1000), and slices thicker than pixels (0.9, 0.9, 1.4 mm). Deterministic.
/// [setup]
VoxelVolume make_phantom();

} // namespace palpate
