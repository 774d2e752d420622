// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/geometry/vec.h>

namespace palpate::internal {

struct Corners3 {
    Vec3 a, b, c;
};

/// Distance of the segments pq and rs, m.                                                [any]
double segment_distance(const Vec3& p, const Vec3& q, const Vec3& r, const Vec3& s) noexcept;

/// Distance of the segment pq from a triangle, m; rounding where it pierces it.  [any]
double segment_triangle_distance(const Vec3& p, const Vec3& q, const Corners3& t) noexcept;

/// Distance of two triangles, m; rounding where they intersect. [any]
double triangle_distance(const Corners3& s, const Corners3& t) noexcept;

} // namespace palpate::internal
