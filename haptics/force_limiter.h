// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <palpate/geometry/vec.h>
#include <palpate/haptics/frame_flags.h>

namespace palpate {

struct ForceLimits {
    double force_n = 5.0;         ///< longest force, N, > 0
    double slew_n_per_s = 2000.0; ///< fastest change, N/s, > 0
    double period_s = 1e-3;       ///< nominal frame period, s, > 0
};

/// Last before the device: what leaves here is finite, no longer than the limit, and no further
/// from what left before than the slew limit allows in one period. So it also goes to zero
/// smoothly.
class ForceLimiter {
public:
    explicit ForceLimiter(const ForceLimits& limits) noexcept : limits_(limits) {}

    /// The force to send for a wanted one, N; says in `flags` what it did.              [loop]
    Vec3 limit(Vec3 wanted, std::uint32_t& flags) noexcept {
        if (!is_finite(wanted)) {
            wanted = Vec3{0.0};
            flags |= kForceNotFinite;
        }
        const double length = glm::length(wanted);
        if (length > limits_.force_n) {
            // A length that overflows has no direction worth keeping.
            wanted = std::isfinite(length) ? wanted * (limits_.force_n / length) : Vec3{0.0};
            flags |= kForceClamped;
        }
        const Vec3 change = wanted - sent_;
        const double change_length = glm::length(change);
        const double longest_change = limits_.slew_n_per_s * limits_.period_s;
        if (change_length > longest_change) {
            sent_ += change * (longest_change / change_length);
            flags |= kForceSlewed;
        } else {
            sent_ = wanted;
        }
        return sent_;
    }

    const Vec3& sent() const noexcept { return sent_; } ///< last force, N

private:
    ForceLimits limits_;
    Vec3 sent_{0.0};
};

} // namespace palpate
