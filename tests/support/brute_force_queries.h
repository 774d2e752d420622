// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include <palpate/geometry/triangle_mesh.h>

/// Twins of SurfaceScene's queries: every triangle, one after the other, and no code in common with
/// them.
namespace palpate::test {

struct BruteHit {
    double t = 0.0;        ///< on the segment, 0..1
    double distance = 0.0; ///< m, from the start or the centre
    Vec3 position{0.0};
    std::uint32_t triangle = 0;
    /// How near the answer is to being another one: the smallest of the barycentric coordinates,
    /// and t's distance to the segment's ends, both times their length, m. Where it is below
    /// rounding, hit or no hit are both right.
    double margin_m = 0.0;
};

/// The first triangle on the segment, by Moeller and Trumbore's equations in long double. `room_m`
/// widens every triangle and the segment by that much; negative: only hits that are surely inside.
inline std::optional<BruteHit> brute_first_hit(const TriangleMesh& mesh, const Vec3& from,
                                               const Vec3& to, double room_m = 0.0) {
    using Exact = long double;
    struct V {
        Exact x, y, z;
    };
    const auto diff = [](const Vec3& p, const Vec3& q) {
        return V{Exact(p.x) - q.x, Exact(p.y) - q.y, Exact(p.z) - q.z};
    };
    const auto cross = [](const V& p, const V& q) {
        return V{p.y * q.z - p.z * q.y, p.z * q.x - p.x * q.z, p.x * q.y - p.y * q.x};
    };
    const auto dot = [](const V& p, const V& q) { return p.x * q.x + p.y * q.y + p.z * q.z; };

    std::optional<BruteHit> best;
    const V d = diff(to, from);
    const Exact length = std::sqrt(dot(d, d));
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        const auto& triangle = mesh.triangles[i];
        const Vec3& a = mesh.vertices[triangle[0]];
        const V e1 = diff(mesh.vertices[triangle[1]], a), e2 = diff(mesh.vertices[triangle[2]], a),
                o = diff(from, a);
        const V p = cross(d, e2);
        const Exact determinant = dot(e1, p);
        if (determinant == 0) continue;
        const V q = cross(o, e1);
        const Exact u = dot(o, p) / determinant, v = dot(d, q) / determinant,
                    t = dot(e2, q) / determinant;
        const Exact size = std::sqrt(std::max(dot(e1, e1), dot(e2, e2)));
        const Exact inside = std::min({u, v, 1 - u - v}) * size,
                    along = std::min(t, 1 - t) * length;
        const Exact margin = std::min(inside, along);
        if (margin < -Exact(room_m)) continue;
        if (best && t >= best->t) continue;
        best = BruteHit{double(t), double(t * length), from + double(t) * (to - from), i,
                        double(margin)};
    }
    return best;
}

/// The closest point of the mesh within `radius`; of equal ones that of the lowest triangle. By the
/// foot on the plane and on the three sides.
inline std::optional<BruteHit>
brute_closest_point(const TriangleMesh& mesh, const Vec3& point,
                    double radius = std::numeric_limits<double>::infinity()) {
    const auto on_side = [](const Vec3& p, const Vec3& a, const Vec3& b) {
        const double share = glm::dot(p - a, b - a) / glm::dot(b - a, b - a);
        return a + glm::clamp(share, 0.0, 1.0) * (b - a);
    };
    std::optional<BruteHit> best;
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        const Vec3& a = mesh.vertices[mesh.triangles[i][0]];
        const Vec3& b = mesh.vertices[mesh.triangles[i][1]];
        const Vec3& c = mesh.vertices[mesh.triangles[i][2]];
        const Vec3 n = glm::cross(b - a, c - a);
        const Vec3 foot = point - glm::dot(point - a, n) / glm::dot(n, n) * n;
        const bool inside = glm::dot(glm::cross(b - a, foot - a), n) >= 0.0 &&
                            glm::dot(glm::cross(c - b, foot - b), n) >= 0.0 &&
                            glm::dot(glm::cross(a - c, foot - c), n) >= 0.0;
        Vec3 candidates[3] = {on_side(point, a, b), on_side(point, b, c), on_side(point, c, a)};
        if (inside) candidates[0] = foot;
        for (const Vec3& q : candidates) {
            const double distance = glm::length(q - point);
            if (distance > radius || (best && distance >= best->distance)) continue;
            best = BruteHit{0.0, distance, q, i, 0.0};
        }
    }
    return best;
}

} // namespace palpate::test
