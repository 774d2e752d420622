// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/haptics/proxy_solver.h>

namespace palpate {

/// One line, or one point, and nothing else: the closed form of eq. (4), x' = a' - r min(1, s / (k
/// |r|)) with r the way from the line to a'. `target` is a' (m, scene frame), `stiffness` k (N/m).
/// [loop]
ProxySolution solve_one_line(const LinePrimitive& line, const Vec3& target,
                             double stiffness) noexcept;
ProxySolution solve_one_point(const PointPrimitive& point, const Vec3& target,
                              double stiffness) noexcept;

/// Any mix of planes, lines and points; forces are in `target` already. As solve_proxy(), which
/// chooses between the solvers.                                                          [loop]
ProxySolution solve_mixed(const PrimitiveSet& primitives, const Vec3& target, double stiffness,
                          int pass_cap) noexcept;

} // namespace palpate
