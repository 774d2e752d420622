// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <type_traits>

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

// GLM's macros may give a program other types under these names than Palpate's libraries were
// compiled with, and calls between them would crash, or read other numbers.
static_assert(sizeof(Vec3) == 24 && alignof(Vec3) == 8 && sizeof(Mat3) == 72 &&
                  alignof(Mat3) == 8 && sizeof(Quaternion) == 32 && alignof(Quaternion) == 8,
              "Palpate needs GLM's packed types: define GLM_FORCE_DEFAULT_ALIGNED_GENTYPES nowhere "
              "in this program's sources that include Palpate; glm::aligned_dvec3 stays usable");
static_assert(std::is_trivially_copyable_v<Vec3> && std::is_trivially_copyable_v<Mat3> &&
                  std::is_trivially_copyable_v<Quaternion>,
              "Palpate passes GLM's types as plain numbers: define GLM_FORCE_CTOR_INIT nowhere in "
              "this program's sources that include Palpate");
static_assert(
    offsetof(Quaternion, x) == 0 && offsetof(Quaternion, w) == 24,
    "Palpate stores quaternions as x, y, z, w: define GLM_FORCE_QUAT_DATA_WXYZ nowhere in "
    "this program's sources that include Palpate");
#ifdef GLM_FORCE_QUAT_CTOR_XYZW
#error "Palpate builds quaternions from w, x, y, z: do not define GLM_FORCE_QUAT_CTOR_XYZW"
#endif

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
