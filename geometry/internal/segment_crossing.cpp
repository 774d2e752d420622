// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/internal/segment_crossing.h>

#include <algorithm>
#include <cmath>

#include <palpate/geometry/triangle_mesh.h>

namespace palpate::internal {
namespace {

// Between a point of a segment and the triangle's nearest point where they are one, in roundings of
// a place: both are computed.
constexpr double kRoundingsOfNearest = 8.0;
// The square of how thin a triangle is multiplies that, up to where closest_point_on_triangle()
// takes it for a sliver and is exact.
constexpr double kThinOfSliver = 1.0e4;

double sum_of_sizes(const Vec3& v) noexcept {
    return std::abs(v.x) + std::abs(v.y) + std::abs(v.z);
}

/// Whether a point of the segment, on its line in `on_line` at `distance` from its start, is one of
/// the triangle too, to `room`: the nearer end of the segment where it is none of the segment's.
bool meets_at(const Segment& s, const Corners3& corner, const Vec3& on_line, double distance,
              double room, Crossing& crossing) noexcept {
    const double at = std::clamp(distance, 0.0, s.length);
    const Vec3 of_segment = at == distance ? on_line : s.from + at * s.direction;
    crossing.point = closest_point_on_triangle(of_segment, corner.a, corner.b, corner.c);
    crossing.distance = std::clamp(glm::dot(crossing.point - s.from, s.direction), 0.0, s.length);
    return squared_length(crossing.point - of_segment) <= room * room;
}

/// Where the segment's line comes nearest to the line pq: on it, from its point nearest to zero.
double approach_to(const Vec3& direction, const Vec3& p, const Vec3& q) noexcept {
    const Vec3 edge = q - p;
    const Vec3 edge_across = edge - glm::dot(edge, direction) * direction;
    const Vec3 p_across = p - glm::dot(p, direction) * direction;
    const double squared = squared_length(edge_across);
    const double t =
        squared > 0.0 ? std::clamp(-glm::dot(p_across, edge_across) / squared, 0.0, 1.0) : 0.0;
    return glm::dot(p + t * edge, direction);
}

/// A segment in the triangle's plane meets it where it begins, or first passes an edge. `a`, `b`,
/// `c`: the corners from the point of the line at `near` from its start.
bool meets_in_plane(const Segment& s, const Corners3& corner, const Corners3& from_line,
                    double near, double room, Crossing& crossing) noexcept {
    const Corners3& c = from_line;
    bool found = false;
    for (const double distance :
         {0.0, near + approach_to(s.direction, c.a, c.b), near + approach_to(s.direction, c.b, c.c),
          near + approach_to(s.direction, c.c, c.a)}) {
        Crossing one;
        if (!meets_at(s, corner, s.from + distance * s.direction, distance, room, one)) continue;
        if (!found || one.distance < crossing.distance) crossing = one;
        found = true;
    }
    return found;
}

} // namespace

bool crosses(const Segment& s, const Corners3& corner, double widening,
             Crossing& crossing) noexcept {
    // From the point of the line that is nearest to a corner, so that what is multiplied is small.
    const double near = glm::dot(corner.a - s.from, s.direction);
    const Vec3 origin = s.from + near * s.direction;
    const Vec3 a = corner.a - origin, b = corner.b - origin, c = corner.c - origin;
    const double reach =
        std::max({sum_of_sizes(a), sum_of_sizes(b), sum_of_sizes(c)}) + s.rounding + widening;
    if (near + 2.0 * reach < 0.0 || near - 2.0 * reach > s.length) return false;

    // The line passes all three edges on the same side: (a x b) . d is its distance from the edge
    // times the edge's length.
    const double room = 2.0 * s.rounding * reach;
    const double u = glm::dot(s.direction, glm::cross(b, c));
    const double v = glm::dot(s.direction, glm::cross(c, a));
    const double w = glm::dot(s.direction, glm::cross(a, b));
    const Vec3 n = glm::cross(b - a, c - a);
    const double across = glm::dot(n, s.direction);
    const double size = glm::length(n); // twice the area, m^2
    double room_u = room, room_v = room, room_w = room;
    if (widening > 0.0) {
        // Where the line meets the plane it may be that far beside an edge; seen along the line
        // that is less the flatter it comes, and nothing when it runs along the plane.
        const double foreshortened = widening * std::abs(across) / size;
        room_u += foreshortened * glm::length(c - b);
        room_v += foreshortened * glm::length(a - c);
        room_w += foreshortened * glm::length(b - a);
    }
    const bool left = u >= -room_u && v >= -room_v && w >= -room_w;
    const bool right = u <= room_u && v <= room_v && w <= room_w;
    if (!left && !right) return false;

    // What rounding may put between a point of the line and the plane: the more, the thinner the
    // triangle. Beside a corner the widened edges reach farther out than beside an edge.
    const double height = glm::dot(n, a);
    const double thin = std::max(1.0, reach * reach / size);
    const double rounding = s.rounding * thin;
    const double near_by = kRoundingsOfNearest * s.rounding *
                           std::max(thin, std::pow(std::min(thin, kThinOfSliver), 2));

    // The flatter the line comes, the less is known of where it meets the plane; beyond an edge it
    // then is that edge that it passes. If it lies in the plane the three above say nothing at all.
    if (std::abs(height) < reach * std::abs(across) && rounding * size < reach * std::abs(across)) {
        const double along = height / across, distance = near + along;
        const double beyond = distance - std::clamp(distance, 0.0, s.length);
        if (std::abs(beyond * across) > rounding * size) return false;
        if (meets_at(s, corner, origin + along * s.direction, distance,
                     near_by + 2.0 * widening * thin, crossing))
            return true;
    }
    return meets_in_plane(s, corner, {a, b, c}, near, near_by, crossing);
}

} // namespace palpate::internal
