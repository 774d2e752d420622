// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include <palpate/geometry/vec.h>

/// What is found in a volume on its way to a surface.
namespace palpate {

/// How far the surface of one field lies from that of another, along normals, positive = into free
/// space (the material grew).
struct SurfaceShift {
    double mean_m = 0.0;      ///< mean over the points
    double deviation_m = 0.0; ///< standard deviation
    std::size_t points = 0;   ///< points of the reference surface where both were found within 2
                              ///< voxels along the normal
};

/// A connected part of the material.
struct VolumeComponent {
    std::size_t voxels = 0;  ///< > 0
    double volume_mm3 = 0.0; ///< of these voxels
    bool kept = true;        ///< false: a ComponentPolicy removed it
    Vec3 sample{0.0};        ///< scene position of one of its voxels, m
};

/// A connected part of a label that smoothing took away: thinner than the Gaussian can keep.
struct ThinPart {
    std::size_t voxels = 0;  ///< > 0
    double volume_mm3 = 0.0; ///< of these voxels
    Vec3 sample{0.0};        ///< scene position of its voxel farthest below the level, m
};

} // namespace palpate
