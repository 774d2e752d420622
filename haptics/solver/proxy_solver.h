// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/haptics/solver/fixed_vector.h>
#include <palpate/haptics/solver/primitives.h>

namespace palpate {

/// What became of a primitive's multiplier.
enum class MultiplierState {
    released,  ///< lambda = 0: the primitive is not felt
    active,    ///< 0 < lambda < s: it holds
    saturated, ///< lambda = s: it yields
};

/// What became of a line or a point.
enum class TetherState {
    released, ///< not felt: unusable, or without strength
    held,     ///< the proxy is on it: |w| <= s
    slipping, ///< the proxy is off it, which draws with its strength: |w| = s
};
/// How exact a solution is.
enum class SolveStatus {
    exact,  ///< residual_m within rounding of the problem's scale
    capped, ///< cap or rounding reached first: residual_m and error_bound_m say how far from exact
};

/// What a plane does in a solution.
struct PlaneOutcome {
    double multiplier_n = 0.0;                         ///< lambda, N
    MultiplierState state = MultiplierState::released; ///< where lambda is
};

/// What a line or a point does in a solution.
struct TetherOutcome {
    Vec3 force_n{0.0};                         ///< on the proxy, N, scene frame
    TetherState state = TetherState::released; ///< whether it holds
};

/// What solve_proxy() found; planes, lines and points each numbered as in the PrimitiveSet.
struct ProxySolution {
    ProxySolution() noexcept = default;
    /// Nothing felt, and the proxy where it is drawn to.
    ProxySolution(const PrimitiveSet& primitives, const Vec3& target) noexcept {
        restart(primitives, target);
    }
    /// The same again, without a copy.                                                   [loop]
    void restart(const PrimitiveSet& primitives, const Vec3& target) noexcept {
        proxy = target;
        planes.assign(primitives.planes().size(), {});
        lines.assign(primitives.lines().size(), {});
        points.assign(primitives.points().size(), {});
        residual_m = error_bound_m = 0.0;
        passes = work = 0;
        status = SolveStatus::exact;
    }

    Vec3 proxy{0.0};                                            ///< m, scene frame
    FixedVector<PlaneOutcome, PrimitiveSet::kCapacity> planes;  ///< of each plane
    FixedVector<TetherOutcome, PrimitiveSet::kCapacity> lines;  ///< of each line
    FixedVector<TetherOutcome, PrimitiveSet::kCapacity> points; ///< of each point
    double residual_m = 0.0; ///< natural residual of the optimality conditions, m (numerics 1.1)
    /// The minimiser x* is no further than this from `proxy`, m: with E and its dual D in units of
    /// k, E - D >= 1/2 |x - x*|^2 + 1/2 |x - x*|^2, since both are strongly convex and the proxy is
    /// a' plus all multipliers over k. So |x - x*| <= sqrt(E - D), and for these multipliers
    ///   E - D = sum over planes [sigma max(0, -g) + lambda g] + sum over others [sigma |r| + w.r]
    /// (sigma = s / k, g and r the offsets). A square root of rounding where the solution is exact,
    /// so its use is to judge one that is not. 0: closed form.
    double error_bound_m = 0.0;
    int passes = 0; ///< over all primitives, where lines or points are among several; else 0
    int work = 0;   ///< primitives looked at, each as often as it was: what solving took
    SolveStatus status = SolveStatus::exact; ///< says whether the cap was reached first
};

/// Passes over the primitives after which a sub-step's solution must do: about 20 us with sixteen.
/// Six primitives need 14 in the median and some 50 in one case of a thousand.
inline constexpr int kLoopPasses = 64;

/// F of eqs (2) and (5): the proxy position where the primitives' forces balance the coupling's.
/// [loop]
///   x' = argmin_x  k/2 |x - a|^2 - F0.x + sum over springs g/2 |x - q|^2
///                                      + sum over planes  s max(0, -n.(x - p))
///                                      + sum over lines   s |(1 - u u^T)(x - q)|
///                                      + sum over points  s |x - q|
/// with a the probe (m, scene frame), k = `coupling` > 0 its stiffness (N/m). Eq. (5) read as a
/// set-valued force balance (docs/equations.md): the minimiser is unique, moves no further than the
/// probe does, and |x' - a'| <= |y - a'| for every y with no more primitive energy. Eq. (4) is its
/// closed form for primitives along an orthonormal frame through the proxy. Planes that
/// share a strength have s max(0, max over them of -n.(x - p)) together. Primitives that are not
/// finite, without direction or without strength are ignored. Infinite strengths are solved as 64 k
/// times the problem's scale (the furthest anchor's distance from PrimitiveSet::pull; k with the
/// springs): an infeasible hard set becomes a defined compromise. No allocation. Bounded by
/// `pass_cap` passes over the primitives and up to 16 to end a step, planes alone by 40 n + 60,
/// too, which suffice. Then the solution is the best one so far, and its status says so. Planes
/// that share a strength are solved again and again: altogether by what `pass_cap` passes look at.
void solve_proxy(const PrimitiveSet& primitives, const Vec3& probe, double coupling, int pass_cap,
                 ProxySolution& solution) noexcept;
/// The same as a value.                                                                 [loop]
inline ProxySolution solve_proxy(const PrimitiveSet& primitives, const Vec3& probe, double coupling,
                                 int pass_cap = kLoopPasses) noexcept {
    ProxySolution solution;
    solve_proxy(primitives, probe, coupling, pass_cap, solution);
    return solution;
}

} // namespace palpate
