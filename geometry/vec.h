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
    Vec3 lower{std::numeric_limits<double>::infinity()};  ///< smallest coordinates
    Vec3 upper{-std::numeric_limits<double>::infinity()}; ///< largest coordinates

    /// Grows until it holds p.                                                              [any]
    void add(const Vec3& p) noexcept {
        lower = glm::min(lower, p);
        upper = glm::max(upper, p);
    }
    /// No point is in it: lower > upper on some axis.                                       [any]
    bool empty() const noexcept {
        return lower.x > upper.x || lower.y > upper.y || lower.z > upper.z;
    }
    Vec3 center() const noexcept { return 0.5 * (lower + upper); } ///< NaN of an empty one  [any]
    /// Lengths of its edges; not of an empty one.                                            [any]
    Vec3 extent() const noexcept { return upper - lower; }
};

/// p -> linear * p + offset.
struct AffineTransform {
    Mat3 linear{1.0}; ///< its columns are the images of the axes
    Vec3 offset{0.0}; ///< the image of the origin

    /// Image of a place.                                                                     [any]
    Vec3 point(const Vec3& p) const noexcept { return linear * p + offset; }
    /// Image of a difference of two places.                                                  [any]
    Vec3 direction(const Vec3& d) const noexcept { return linear * d; }
    /// The inverse map; `linear` must be regular (readers refuse files where it is not).
    AffineTransform inverse() const noexcept {
        const Mat3 inverse_linear = glm::inverse(linear);
        return {inverse_linear, -(inverse_linear * offset)};
    }
};

} // namespace palpate
