// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <random>
#include <utility>

#include <palpate/geometry/surface_scene.h>

namespace palpate::test {

inline SurfaceScene scene_of(TriangleMesh mesh) {
    return SurfaceScene(std::make_shared<const TriangleMesh>(std::move(mesh)));
}

/// In a cube of half edge `half`, m, about the origin.
inline Vec3 random_point(std::mt19937_64& random, double half) {
    std::uniform_real_distribution<double> in(-half, half);
    const double x = in(random), y = in(random), z = in(random);
    return {x, y, z};
}

/// A unit vector, each as likely.
inline Vec3 random_direction(std::mt19937_64& random) {
    while (true) {
        const Vec3 p = random_point(random, 1.0);
        const double length = glm::length(p);
        if (length > 0.1 && length <= 1.0) return p / length;
    }
}

/// Of one triangle.
inline SurfaceScene scene_of(const Vec3& a, const Vec3& b, const Vec3& c) {
    TriangleMesh mesh;
    mesh.vertices = {a, b, c};
    mesh.triangles = {{0, 1, 2}};
    return scene_of(std::move(mesh));
}

} // namespace palpate::test
