// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include <palpate/volume/label_volume.h>
#include <palpate/volume/vector_volume.h>

#include "tests/stability/random/random_case.h"

#include "tests/support/random_scenes.h"

/// Voxels that are hard to touch: noise, no numbers, steps, saddles, walls thinner than themselves.
namespace palpate::stability {

struct RandomVolume {
    std::string kind;
    VoxelFile file;
    double level = 0.0;         ///< a good one
    double value_per_m = 1.0e3; ///< how fast values rise at walls, about
};

/// Some 10^3 to 18^3 voxels about `place`, 2.4 `size_m` wide; on a frame that may be oblique,
/// anisotropic or left-handed.
RandomVolume random_volume(test::Random& random, double size_m, const Vec3& place);
/// A ball of voxels: label 1, or three labels that meet in an edge.
VoxelFile random_labels(test::Random& random, int labels, double size_m, const Vec3& place);
/// The labels of an atlas about a place of it where some are, from 1 on, at most six of them; each
/// voxel of the atlas becomes one of a cube 2.4 `size_m` wide, on a frame as random_volume()'s.
/// Throws std::invalid_argument where the atlas is too small or has hardly a label.
VoxelFile labels_of(const LabelVolume& atlas, test::Random& random, double size_m,
                    const Vec3& place);
/// A ball of voxels, label 1, with two balls in it, labels 2 and 3; one may stick out of the other.
VoxelFile random_lumps(test::Random& random, double size_m, const Vec3& place);
/// A hollow ball of `radius_m`, its wall thinner than voxels or of a few, with round holes: values
/// are m behind the wall's surface, in a hole -`size_m`. From the middle of a hole to its edge are at
/// most `widest_m`. No mesh of the ball has these holes.
VoxelFile random_sieve(test::Random& random, double radius_m, double widest_m, double size_m,
                       const Vec3& place);
/// Vectors in order or in none, or symmetric tensors.
std::shared_ptr<const VectorVolume> random_vectors(test::Random& random, double size_m,
                                                   const Vec3& place);

} // namespace palpate::stability
