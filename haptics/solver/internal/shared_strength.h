// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/haptics/solver/proxy_solver.h>

namespace palpate::internal {

/// solve_proxy() where each plane has its strength for itself alone.                     [loop]
void solve_unshared(const PrimitiveSet& primitives, const Vec3& probe, double coupling,
                    int pass_cap, ProxySolution& solution) noexcept;

/// solve_proxy() where planes share strengths, PlanePrimitive::shares: begins with the solution of
/// solve_unshared(). Where the planes of a run bear more together than their strength s, the
/// run is at a common depth c behind them, at which hard planes bear s:
///   min over x of  E(x) + s max(0, d(x))  =  min over c >= 0 of  s c + min { E(x) : d(x) <= c },
/// d(x) = max over the run of -n.(x - p). The slope of the inner minimum over c is less the sum of
/// the hard planes' multipliers, which only falls with c: it is searched for where it is s. Bounded
/// by kMostDepths solutions for each run and round, and by `pass_cap` passes more; planes alone,
/// which need none, by as many primitives looked at as these passes would. What a run has begun
/// with then, three solutions, is made.                                                   [loop]
void solve_shared(const PrimitiveSet& primitives, const Vec3& probe, double coupling, int pass_cap,
                  ProxySolution& solution) noexcept;

} // namespace palpate::internal
