// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/internal/triangle_distance.h>

#include <algorithm>
#include <cmath>

#include <palpate/geometry/triangle_mesh.h>

namespace palpate::internal {
namespace {

double point_distance(const Vec3& p, const Corners3& t) noexcept {
    return glm::length(closest_point_on_triangle(p, t.a, t.b, t.c) - p);
}

} // namespace

double segment_distance(const Vec3& p, const Vec3& q, const Vec3& r, const Vec3& s) noexcept {
    // Squared distance of p + x d and r + y e is a convex quadratic on the unit square.
    const Vec3 d = q - p, e = s - r, f = p - r;
    const double dd = glm::dot(d, d), ee = glm::dot(e, e), de = glm::dot(d, e);
    const double df = glm::dot(d, f), ef = glm::dot(e, f);
    const double det = dd * ee - de * de;
    double x = det > 0.0 ? std::clamp((de * ef - ee * df) / det, 0.0, 1.0) : 0.0;
    const double y = ee > 0.0 ? std::clamp((de * x + ef) / ee, 0.0, 1.0) : 0.0;
    x = dd > 0.0 ? std::clamp((de * y - df) / dd, 0.0, 1.0) : 0.0;
    return glm::length(f + x * d - y * e);
}

double segment_triangle_distance(const Vec3& p, const Vec3& q, const Corners3& t) noexcept {
    double nearest =
        std::min({point_distance(p, t), point_distance(q, t), segment_distance(p, q, t.a, t.b),
                  segment_distance(p, q, t.b, t.c), segment_distance(p, q, t.c, t.a)});
    const Vec3 n = glm::cross(t.b - t.a, t.c - t.a);
    const double above_p = glm::dot(n, p - t.a), above_q = glm::dot(n, q - t.a);
    // The point where it passes the plane tells whether it pierces: by its distance, since in one
    // plane with the triangle signs are noise.
    if ((above_p > 0.0) != (above_q > 0.0))
        nearest = std::min(nearest, point_distance(p + above_p / (above_p - above_q) * (q - p), t));
    return nearest;
}

double triangle_distance(const Corners3& s, const Corners3& t) noexcept {
    return std::min({segment_triangle_distance(s.a, s.b, t), segment_triangle_distance(s.b, s.c, t),
                     segment_triangle_distance(s.c, s.a, t), segment_triangle_distance(t.a, t.b, s),
                     segment_triangle_distance(t.b, t.c, s),
                     segment_triangle_distance(t.c, t.a, s)});
}

} // namespace palpate::internal
