// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include <palpate/haptics/solver/primitives.h>

/// What the solvers of planes and of mixed primitives have in common. "Scale" is the distance of
/// the furthest anchor from a', the probe shifted by the forces.
namespace palpate::internal {

// Gap below which a primitive counts as held: rounding of a point at distance `scale` (numerics
// 1.4).
inline constexpr double kAbsoluteGap = 1e-17; // m
inline constexpr double kRelativeGap = 4e-14; // of scale
// Multipliers of hard primitives end at this many times the scale: the exact penalty (numerics
// 1.4).
inline constexpr double kHardMultiplier = 64.0;
// Rounding of a term of the duality gap, of the lengths that go into it: 8 ulp for 8 operations.
inline constexpr double kGapRounding = 1e-15;
// So many passes more than it may take, a solver makes to end a step that it has begun.
inline constexpr int kPassesBeyondCap = 16;

/// Whether a primitive is felt at all: finite, with a direction, with a strength. `bound`: s in N,
/// or s / k in m where what follows divides by that: the smallest s have none.           [loop]
inline bool is_usable(const Vec3& anchor, double direction_length, double bound) noexcept {
    return std::isfinite(direction_length) && direction_length > 0.0 && is_finite(anchor) &&
           bound > 0.0;
}

} // namespace palpate::internal
