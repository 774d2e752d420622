// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/haptics/solver/proxy_solver.h>

namespace palpate::internal {

/// The only line, or the only point: the closed form of eq. (4), x' = a' - r min(1, s / (k |r|))
/// with r the way from it to a'. `target` is a' (m, scene frame), `stiffness` k (N/m). `solution`
/// has the proxy at a', or, with a line, moved from there along it, as planes across it do. [loop]
void add_one_line(const LinePrimitive& line, const Vec3& target, double stiffness,
                  ProxySolution& solution) noexcept;
void add_one_point(const PointPrimitive& point, const Vec3& target, double stiffness,
                   ProxySolution& solution) noexcept;

/// Any mix of planes, lines and points; forces are in `target` already. As solve_proxy(), which
/// chooses between the solvers.                                                          [loop]
ProxySolution solve_mixed(const PrimitiveSet& primitives, const Vec3& target, double stiffness,
                          int pass_cap) noexcept;

} // namespace palpate::internal
