// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <palpate/geometry/triangle_mesh.h>

#include "tests/support/random_scenes.h"

/// Meshes as users have them and as nobody should: sharp, thin, doubled, inverted, nested, torn,
/// one-sided.
namespace palpate::stability {

/// A mesh about the origin, some 2 `size_m` large, and what it is in a word.
struct RandomMesh {
    std::string kind;
    TriangleMesh mesh; ///< m
};

RandomMesh random_mesh(test::Random& random, double size_m);

/// A prism of 2 `size_m` along y whose edge at the origin has this angle, its body below.
TriangleMesh prism(double angle_deg, double size_m);

} // namespace palpate::stability
