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

/// Whether two triangles have `gap_m` between them along an axis of any length. Corners are from
/// one of them, so that what is rounded is as small as they are.
bool apart_along(const Vec3& axis, const Corners3& s, const Corners3& t, double gap_m) noexcept {
    const double sa = glm::dot(axis, s.a), sb = glm::dot(axis, s.b), sc = glm::dot(axis, s.c);
    const double ta = glm::dot(axis, t.a), tb = glm::dot(axis, t.b), tc = glm::dot(axis, t.c);
    const double gap = std::max(std::min({ta, tb, tc}) - std::max({sa, sb, sc}),
                                std::min({sa, sb, sc}) - std::max({ta, tb, tc}));
    return gap > 0.0 && gap * gap >= gap_m * gap_m * squared_length(axis);
}

/// Planes of a triangle, and planes through its edges across it.
bool apart_of_faces(const Corners3& s, const Corners3& t, double gap_m) noexcept {
    const Vec3 normal = glm::cross(s.b - s.a, s.c - s.a);
    return apart_along(normal, s, t, gap_m) ||
           apart_along(glm::cross(normal, s.b - s.a), s, t, gap_m) ||
           apart_along(glm::cross(normal, s.c - s.b), s, t, gap_m) ||
           apart_along(glm::cross(normal, s.a - s.c), s, t, gap_m);
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

bool told_apart(const Corners3& s, const Corners3& t, double gap_m) noexcept {
    const Corners3 here{Vec3{0.0}, s.b - s.a, s.c - s.a};
    const Corners3 there{t.a - s.a, t.b - s.a, t.c - s.a};
    const Vec3 between = there.a + there.b + there.c - here.b - here.c; // three times the centres'
    return apart_along(between, here, there, gap_m) || apart_of_faces(here, there, gap_m) ||
           apart_of_faces(there, here, gap_m);
}

bool told_apart_at_corner(const Corners3& s, const Corners3& t, double gap_m) noexcept {
    const Vec3 sb = s.b - s.a, sc = s.c - s.a, tb = t.b - t.a, tc = t.c - t.a;
    // One triangle's edge lies beyond the gap on one side of the plane; the other one lies on the
    // other side of it, or in it.
    const Vec3 axis = tb + tc - sb - sc;
    const double gap = std::min(
        {glm::dot(axis, tb), glm::dot(axis, tc), -glm::dot(axis, sb), -glm::dot(axis, sc)});
    return gap > 0.0 && gap * gap >= gap_m * gap_m * squared_length(axis);
}

bool told_apart_at_edge(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d,
                        double gap_m) noexcept {
    const Vec3 edge = b - a;
    const double squared_edge = squared_length(edge);
    const auto across_edge = [&](const Vec3& v) { // times squared_edge
        return squared_edge * v - glm::dot(v, edge) * edge;
    };
    const Vec3 to_c = across_edge(c - a), to_d = across_edge(d - a);
    // In the direction across the edge to d, all of abd is at 0 or above, and c below it.
    const double below = -glm::dot(to_c, to_d); // times squared_edge twice
    const double gap = gap_m * squared_edge;
    return below > 0.0 &&
           below * below >= gap * gap * std::max(squared_length(to_c), squared_length(to_d));
}

} // namespace palpate::internal
