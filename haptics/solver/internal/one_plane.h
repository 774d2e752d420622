// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include <palpate/haptics/solver/internal/solver_limits.h>
#include <palpate/haptics/solver/proxy_solver.h>

namespace palpate::internal {

/// One plane, as most evaluations have: lambda is the depth, within its bounds. `solution` is
/// restarted for it, with room for the plane.                                            [loop]
inline void add_one_plane(const PlanePrimitive& plane, const Vec3& target, double stiffness,
                          ProxySolution& solution) noexcept {
    const double length = glm::length(plane.normal);
    if (!is_usable(plane.anchor, length, plane.strength_n)) return;
    const Vec3 normal = plane.normal / length;
    const double offset = glm::dot(normal, plane.anchor - target);
    if (!(offset > kAbsoluteGap)) return;
    const double sigma = plane.strength_n / stiffness;
    const double lambda = std::min(offset, sigma);
    solution.proxy = target + lambda * normal;
    solution.planes[0] = {stiffness * lambda,
                          lambda < sigma ? MultiplierState::active : MultiplierState::saturated};
    const double gap = glm::dot(normal, lambda * normal) - offset;
    solution.residual_m = std::abs(lambda - std::clamp(lambda - gap, 0.0, sigma));
}

} // namespace palpate::internal
