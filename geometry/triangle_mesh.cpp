// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/triangle_mesh.h>

#include <algorithm>

namespace palpate {
namespace {

// |cross| / longest edge squared below which a triangle has no normal worth the name: rounding of
// 1e-16 in the edges turns it by up to 1e-7 there.
constexpr double kDegenerateRatio = 1.0e-9;

// The same ratio, below which barycentric coordinates lose too much: they are differences of
// products that are longer than the triangle is high by this ratio, squared.
constexpr double kSliverRatio = 1.0e-3;

Vec3 closest_point_on_segment(const Vec3& p, const Vec3& a, const Vec3& b) noexcept {
    const Vec3 ab = b - a;
    const double length_squared = squared_length(ab);
    if (!(length_squared > 0.0)) return a;
    return a + glm::clamp(glm::dot(p - a, ab) / length_squared, 0.0, 1.0) * ab;
}

/// For a triangle so thin that rounding left no region to its barycentric coordinates.
Vec3 closest_point_on_sides(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) noexcept {
    Vec3 closest = closest_point_on_segment(p, a, b);
    for (const Vec3& q : {closest_point_on_segment(p, b, c), closest_point_on_segment(p, c, a)})
        if (squared_length(q - p) < squared_length(closest - p)) closest = q;
    return closest;
}

/// Whether a triangle of these products of two of its edges is thin as a hair.
bool is_sliver(double ab_ab, double ac_ac, double ab_ac) noexcept {
    const double longest = std::max(ab_ab, ac_ac); // no edge is longer than twice that
    return ab_ab * ac_ac - ab_ac * ab_ac < kSliverRatio * kSliverRatio * longest * longest;
}

/// Of a triangle that is thin as a hair: its plane's foot where that is within the edges, which
/// how far it is from each tells to rounding.
Vec3 closest_point_on_sliver(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) noexcept {
    const Vec3 ab = b - a, ac = c - a, bc = c - b;
    Vec3 along = squared_length(ab) > squared_length(ac) ? ab : ac;
    if (squared_length(bc) > squared_length(along)) along = bc;
    Vec3 across = glm::cross(ab, ac);
    across -= glm::dot(across, along) / squared_length(along) * along; // rounding tilts it
    const double area = glm::length(across);
    if (!(area > 0.0)) return closest_point_on_sides(p, a, b, c);
    const Vec3 normal = across / area;
    const auto is_inside = [&](const Vec3& from, const Vec3& to) {
        return glm::dot(glm::cross(normal, to - from), p - from) >= 0.0;
    };
    if (!is_inside(a, b) || !is_inside(b, c) || !is_inside(c, a))
        return closest_point_on_sides(p, a, b, c);
    return p - glm::dot(normal, p - a) * normal;
}

} // namespace

bool is_degenerate(const Vec3& a, const Vec3& b, const Vec3& c) noexcept {
    const Vec3 ab = b - a, ac = c - a, bc = c - b;
    const double longest = std::max({squared_length(ab), squared_length(ac), squared_length(bc)});
    return !(glm::length(glm::cross(ab, ac)) > kDegenerateRatio * longest);
}

Vec3 triangle_normal(const Vec3& a, const Vec3& b, const Vec3& c) noexcept {
    if (is_degenerate(a, b, c)) return Vec3{0.0};
    return glm::normalize(glm::cross(b - a, c - a));
}

Vec3 closest_point_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b,
                               const Vec3& c) noexcept {
    const Vec3 ab = b - a, ac = c - a, ap = p - a;

    // Vertex regions, and with their products the edge regions beside them.
    const double d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
    if (d1 <= 0.0 && d2 <= 0.0) return a;
    const Vec3 bp = p - b;
    const double d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
    if (d3 >= 0.0 && d4 <= d3) return b;
    const Vec3 cp = p - c;
    const double d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
    if (is_sliver(d1 - d3, d2 - d6, d1 - d5)) return closest_point_on_sliver(p, a, b, c);
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return d1 > d3 ? a + d1 / (d1 - d3) * ab : a;
    if (d6 >= 0.0 && d5 <= d6) return c;
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return d2 > d6 ? a + d2 / (d2 - d6) * ac : a;
    const double va = d3 * d6 - d5 * d4;
    const double along = d4 - d3, back = d5 - d6;
    if (va <= 0.0 && along >= 0.0 && back >= 0.0)
        return along + back > 0.0 ? b + along / (along + back) * (c - b) : b;

    const double sum = va + vb + vc;
    if (va >= 0.0 && vb >= 0.0 && vc >= 0.0 && sum > 0.0) return a + vb / sum * ab + vc / sum * ac;
    return closest_point_on_sides(p, a, b, c);
}

} // namespace palpate
