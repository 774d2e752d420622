// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/geometry/internal/triangle_distance.h>
#include <palpate/geometry/vec.h>

namespace palpate::internal {

/// A segment and what its rounding allows.
struct Segment {
    Vec3 from;             ///< m
    Vec3 direction;        ///< unit
    double length = 0.0;   ///< m, > 0
    double rounding = 0.0; ///< of a place on it, m, > 0
};

/// Where a segment meets a triangle.
struct Crossing {
    double distance = 0.0; ///< from the segment's start, m, within its length
    Vec3 point{0.0};       ///< of the triangle, m
};

/// Whether a segment meets a triangle that is not degenerate, in double. One that it meets exactly
/// is never refused, so a closed mesh lets nothing through, at edges and vertices too. One that it
/// passes by more than some times the rounding is never taken: of a thin triangle the more times,
/// up to the square of its length over its height. `widening`, >= 0, moves its edges outwards, m.
/// `crossing` is written where it meets.                                                [any]
bool crosses(const Segment& segment, const Corners3& corner, double widening,
             Crossing& crossing) noexcept;

} // namespace palpate::internal
