// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <palpate/haptics/contact/surface_state.h>
#include <palpate/haptics/solver/gain.h>

namespace palpate {

/// How strong a surface is while its gain stays as it is: the same for every contact that yields.
struct SurfaceStrength {
    static constexpr double kNever = std::numeric_limits<double>::infinity();
    /// The least strength of what is not off, N: nobody feels it. A plane without any strength says
    /// nothing about how hard it is pressed, so its surface would never give way.
    static constexpr double kLeast_n = 1e-6;

    /// Of its planes, N, >= 0; infinite for a membrane: it is offered as hard, and the loop sees
    /// when it opens.
    double offered_n = kNever;
    double opens_above_n = kNever; ///< N, > 0; infinite: it is no membrane now
    bool off = false;              ///< gain 0

    /// Of a surface of strength `own_n`, N, >= 0. A membrane whose gain moves gives way as a
    /// surface that holds. [any]
    static SurfaceStrength of(double own_n, Yielding yielding, const Gain& gain) noexcept {
        const double strength_n = std::max(gain.strength_n(own_n), gain.off() ? 0.0 : kLeast_n);
        const bool opens = yielding == Yielding::opens && !gain.moving && !gain.off();
        return {opens ? kNever : strength_n, opens ? strength_n : kNever, gain.off()};
    }

    bool is_membrane() const noexcept { return std::isfinite(opens_above_n); } ///< [any]
    /// Whether it neither yields nor opens, however hard it is pressed.                  [any]
    bool is_hard() const noexcept { return std::isinf(offered_n) && !is_membrane(); }
};

} // namespace palpate
