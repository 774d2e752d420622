// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include <palpate/geometry/vec.h>

namespace palpate::internal {

/// Where a line runs inside a sphere around the origin: t of from + t along, not limited to [0,1].
struct SphereChord {
    double enter = 0.0;
    double leave = 0.0;
};

/// Crossings of the line from + t along with a sphere around the origin; nothing when it misses,
/// does not move, or the radius is negative. Without cancellation: the discriminant is a product,
/// the smaller root the quotient of the larger.        [loop]
inline std::optional<SphereChord> sphere_chord(const Vec3& from, const Vec3& along,
                                               double radius) noexcept {
    const double size = std::max({std::abs(from.x), std::abs(from.y), std::abs(from.z),
                                  std::abs(along.x), std::abs(along.y), std::abs(along.z), radius});
    constexpr double kHuge = 1e70; // m: fourth powers stay finite below
    const double scale = size > kHuge ? kHuge / size : 1.0;
    const Vec3 p = scale * from;
    const Vec3 d = scale * along;
    const double r = scale * radius;
    const double a = glm::dot(d, d);
    constexpr double kStill = 1e-200; // m^2: a segment of no length
    if (a < kStill || radius < 0.0) return std::nullopt;
    const double speed = std::sqrt(a);
    const double offset =
        glm::length(glm::cross(p, d)); // distance of the line from the centre, times speed
    const double discriminant = (speed * r - offset) * (speed * r + offset);
    if (discriminant < 0.0) return std::nullopt;
    const double b = glm::dot(p, d);
    const double q = std::abs(b) + std::sqrt(discriminant);
    const double length = glm::length(p);
    const double c = (length - r) * (length + r);
    if (!(q > 0.0)) return SphereChord{0.0, 0.0}; // it starts where it touches
    const double far = q / a;
    const double near =
        c / q; // both positive when `from` is outside and the line runs towards the sphere
    return b <= 0.0 ? SphereChord{near, far} : SphereChord{-far, -near};
}

} // namespace palpate::internal
