// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <palpate/geometry/surface_scene.h>

#include "tests/support/test_meshes.h"

/// What a proxy on a mesh should do, computed in ways that have nothing in common with walking.
namespace palpate::test {

/// The closest point of a star-shaped mesh about the origin to a point near it, by looking at every
/// triangle whose direction is within `angle_rad` of the point's.
class ConeSearch {
public:
    ConeSearch(const TriangleMesh& mesh, double angle_rad)
        : mesh_(mesh), cosine_(std::cos(angle_rad)) {
        for (const auto& t : mesh.triangles)
            directions_.push_back(
                glm::normalize(mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]));
    }
    Vec3 closest(const Vec3& point) const {
        const Vec3 direction = glm::normalize(point);
        Vec3 best{1e9};
        for (std::size_t i = 0; i < directions_.size(); ++i) {
            if (glm::dot(directions_[i], direction) < cosine_) continue;
            const auto& t = mesh_.triangles[i];
            const Vec3 q = closest_point_on_triangle(point, mesh_.vertices[t[0]],
                                                     mesh_.vertices[t[1]], mesh_.vertices[t[2]]);
            if (squared_length(q - point) < squared_length(best - point)) best = q;
        }
        return best;
    }

private:
    const TriangleMesh& mesh_;
    double cosine_;
    std::vector<Vec3> directions_;
};

/// Where a proxy inside a mesh oriented outwards ends that slides towards a held probe in small
/// steps: straight ahead, and back onto the surface where that has left the inside. A step moves
/// the proxy by 1.5 step_m at most. By closest points alone.
inline Vec3 small_step_flow(const SurfaceScene& scene, Vec3 y, const Vec3& probe, double step_m) {
    const double longest = 50.0 * step_m; // straight ahead: below what the surface curves within
    const auto inside_of = [&](const Vec3& z) {
        const auto near = scene.closest_point(z, 1.1 * longest);
        return near && glm::dot(z - near->position, near->normal) > 0.0 ? near->position : z;
    };
    double ahead = step_m;
    for (int i = 0; i < 1000000; ++i) {
        const double distance = glm::length(probe - y);
        if (distance <= 1e-12) break;
        const Vec3 z = inside_of(y + std::min(1.0, ahead / distance) * (probe - y));
        const double moved = glm::length(z - y);
        if (moved > 1.5 * step_m) {
            ahead *= 0.5;
            continue;
        }
        // A thousandth of a step, though the longest was tried: it is there.
        if (moved < 1e-3 * step_m && ahead >= longest) break;
        if (!(glm::length(probe - z) < distance)) {
            if (ahead < 1e-3 * step_m) break;
            ahead *= 0.5;
            continue;
        }
        y = z;
        if (moved < 0.7 * step_m) ahead = std::min(2.0 * ahead, longest);
    }
    return y;
}

/// How much nearer to the probe a step of `step_m` from x along one of the triangles there leads,
/// m; 0 at a local minimum on the mesh. Looks at every triangle that contains x.
inline double descent_left(const SurfaceScene& scene, const Vec3& x, const Vec3& probe,
                           double step_m) {
    std::vector<std::uint32_t> near;
    scene.triangles_near(x, 1e-9, near);
    const TriangleMesh& mesh = scene.mesh();
    const Vec3 pull = glm::normalize(probe - x);
    double most = 0.0;
    for (const std::uint32_t i : near) {
        const auto& t = mesh.triangles[i];
        const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
        if (glm::length(closest_point_on_triangle(x, a, b, c) - x) > 1e-11) continue;
        const Vec3 q = closest_point_on_triangle(x + step_m * pull, a, b, c);
        most = std::max(most, glm::length(q - x) > 0.0 ? glm::dot(q - x, pull) : 0.0);
    }
    return most;
}

/// A sphere of 12 n^2 triangles: the cube's squares, projected. For sizes between icospheres.
inline TriangleMesh cube_sphere(std::uint32_t n) {
    TriangleMesh mesh;
    for (int axis = 0; axis < 3; ++axis)
        for (const double sign : {-1.0, 1.0}) {
            const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
            for (std::uint32_t j = 0; j <= n; ++j)
                for (std::uint32_t i = 0; i <= n; ++i) {
                    Vec3 p;
                    p[axis] = sign;
                    p[(axis + 1) % 3] = std::tan(0.78539816339744831 * (2.0 * i / n - 1.0));
                    p[(axis + 2) % 3] = std::tan(0.78539816339744831 * (2.0 * j / n - 1.0));
                    for (int k = 0; k < 3; ++k) // the edges of two squares get the same bits
                        if (std::abs(std::abs(p[k]) - 1.0) < 1e-12) p[k] = p[k] < 0 ? -1.0 : 1.0;
                    mesh.vertices.push_back(glm::normalize(p));
                }
            for (std::uint32_t j = 0; j < n; ++j)
                for (std::uint32_t i = 0; i < n; ++i) {
                    const std::uint32_t a = first + j * (n + 1) + i, b = a + 1, c = a + n + 1,
                                        d = c + 1;
                    if (sign > 0.0) {
                        mesh.triangles.push_back({a, b, d});
                        mesh.triangles.push_back({a, d, c});
                    } else {
                        mesh.triangles.push_back({a, d, b});
                        mesh.triangles.push_back({a, c, d});
                    }
                }
        }
    return mesh;
}

/// From the centre to 55 mm and twice round, `step` m per frame: the paper's path.
inline std::vector<Vec3> out_and_round(double step, double radius = 0.055) {
    std::vector<Vec3> path;
    for (double r = 0.0; r < radius; r += step)
        path.push_back({r, 0, 0});
    for (double angle = 0.0; angle < 4.0 * 3.14159265358979323846; angle += step / radius)
        path.push_back(radius * Vec3{std::cos(angle), std::sin(angle), 0});
    return path;
}

} // namespace palpate::test
