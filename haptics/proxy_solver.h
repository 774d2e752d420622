// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include <palpate/haptics/primitives.h>

namespace palpate {

/// What became of a primitive's multiplier.
enum class MultiplierState {
    released,  ///< lambda = 0: the primitive is not felt
    active,    ///< 0 < lambda < s: it holds
    saturated, ///< lambda = s: it yields
};

enum class SolveStatus {
    exact,  ///< residual_m within rounding of the problem's scale
    capped, ///< iteration cap reached: residual_m says how far from exact
};

struct ProxySolution {
    Vec3 proxy{0.0};                                            ///< m, scene frame
    std::array<double, PrimitiveSet::kCapacity> multiplier_n{}; ///< lambda_i, N
    std::array<MultiplierState, PrimitiveSet::kCapacity> state{};
    double residual_m = 0.0; ///< natural residual of the optimality conditions, m (numerics 1.1)
    SolveStatus status = SolveStatus::exact;
};

/// F of eqs (2) and (5): the proxy position where the primitives' forces balance the coupling's.
/// [loop]
///   x' = argmin_x  k/2 |x - a|^2 - d.x + sum_i s_i max(0, -n_i.(x - p_i))
/// with a the probe (m, scene frame), k > 0 its stiffness (N/m). Eq. (5) read as a set-valued force
/// balance (numerics 1.1): the minimiser is unique and |x' - a'| <= |y - a'| for every y with no
/// more primitive energy. Planes that are not finite, of zero normal or without strength are
/// ignored. Infinite strengths are solved as 64 k times the problem's scale: an infeasible hard set
/// becomes a defined compromise. Bounded: at most 40 n + 60 steps.
ProxySolution solve_proxy(const PrimitiveSet& primitives, const Vec3& probe,
                          double stiffness) noexcept;

} // namespace palpate
