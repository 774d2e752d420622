// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

/// Vectors, boxes and affine maps. Scene frame unless said otherwise: patient axes LPS, metres,
/// right-handed.
namespace palpate {

using Vec3 = glm::dvec3;       ///< column vector; metres when a position
using Mat3 = glm::dmat3;       ///< column-major: m[column][row]
using Quaternion = glm::dquat; ///< a rotation, of length 1; constructed as (w, x, y, z)

/// True when no component is NaN or infinite.                                           [any]
inline bool is_finite(const Vec3& v) noexcept {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// Squared length, in the square of the vector's unit.                                  [any]
inline double squared_length(const Vec3& v) noexcept { return glm::dot(v, v); }

/// An axis-aligned box; empty (lower > upper) until a point is added.
struct Box {
    Vec3 lower{std::numeric_limits<double>::infinity()};
    Vec3 upper{-std::numeric_limits<double>::infinity()};

    void add(const Vec3& p) noexcept {
        lower = glm::min(lower, p);
        upper = glm::max(upper, p);
    }
    bool empty() const noexcept {
        return lower.x > upper.x || lower.y > upper.y || lower.z > upper.z;
    }
    Vec3 center() const noexcept { return 0.5 * (lower + upper); }
    Vec3 extent() const noexcept { return upper - lower; }
};

/// p -> linear * p + offset.
struct AffineTransform {
    Mat3 linear{1.0};
    Vec3 offset{0.0};

    Vec3 point(const Vec3& p) const noexcept { return linear * p + offset; }
    Vec3 direction(const Vec3& d) const noexcept { return linear * d; }
    /// The inverse map; `linear` must be regular (readers refuse files where it is not).
    AffineTransform inverse() const noexcept {
        const Mat3 inverse_linear = glm::inverse(linear);
        return {inverse_linear, -(inverse_linear * offset)};
    }
};

} // namespace palpate
