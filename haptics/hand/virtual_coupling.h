// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/geometry/range.h>
#include <palpate/geometry/vec.h>

namespace palpate {

/// Spring and damper between probe and proxy.
struct VirtualCoupling {
    double stiffness = 500.0; ///< k_s, N/m, > 0, finite
    double damping = 0.0;     ///< k_d, N s/m, >= 0, finite; 0 = spring alone

    VirtualCoupling() = default;
    /// Throws std::invalid_argument on what is out of range.                            [setup]
    VirtualCoupling(double stiffness_n_per_m, double damping_n_s_per_m)
        : stiffness(stiffness_n_per_m), damping(damping_n_s_per_m) {
        require("coupling: stiffness", stiffness, kPositive);
        require("coupling: damping", damping, kNotNegative);
    }
};

/// Force on the device from the proxy's lag behind the probe.                           [loop]
///   f = -k_s (x_p - x') - k_d (v_p - v')                                               eq. (3)
/// Scene frame, N. Not limited here; see SafetyChain. Finite for finite input.
inline Vec3 coupling_force(const VirtualCoupling& coupling, const Vec3& probe, const Vec3& proxy,
                           const Vec3& probe_velocity, const Vec3& proxy_velocity) noexcept {
    return -coupling.stiffness * (probe - proxy) -
           coupling.damping * (probe_velocity - proxy_velocity);
}

} // namespace palpate
