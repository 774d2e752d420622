// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cmath>
#include <limits>

#include <palpate/drivers/haptic_device.h>
#include <palpate/drivers/internal/newest_value.h>

namespace palpate::internal {

/// Seconds on the monotonic clock, which nobody sets. No system call.                     [any]
inline double steady_s() noexcept {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

/// What the loop and a device's own thread hand to each other, without a wait: the newest state,
/// and the newest force.
class DeviceMailbox {
public:
    /// The thread's: a state, and since when it holds, steady_s().                       [loop]
    void give(const DeviceState& state, double since_s) noexcept { said_.give({state, since_s}); }
    /// The loop's: the newest state there was; true where it is not older than that.     [loop]
    bool newest(DeviceState& state, double longest_s) noexcept {
        said_.take(newest_);
        state = newest_.state;
        return steady_s() - newest_.since_s <= longest_s;
    }

    /// The loop's: the force that it wants now, N.                                       [loop]
    void want(const Vec3& force) noexcept { wanted_.give({force, steady_s()}); }
    /// The thread's: what may be sent of the newest force. It is finite and no longer than
    /// `longest_n`; zero where it is no number, or older than `longest_s`.              [loop]
    Vec3 force(double longest_n, double longest_s) noexcept {
        wanted_.take(force_);
        if (!(steady_s() - force_.since_s <= longest_s) || !is_finite(force_.force))
            return Vec3{0.0};
        const double length = glm::length(force_.force);
        return length <= longest_n ? force_.force : force_.force * (longest_n / length);
    }
    /// The thread's: no force that was wanted up to now is sent any more.               [loop]
    void forget_force() noexcept {
        wanted_.take(force_);
        force_ = {};
    }

private:
    static constexpr double kNever = -std::numeric_limits<double>::infinity();
    struct Said {
        DeviceState state;
        double since_s = kNever;
    };
    struct Wanted {
        Vec3 force{0.0};
        double since_s = kNever;
    };
    NewestValue<Said> said_;
    NewestValue<Wanted> wanted_;
    Said newest_;  ///< the loop's
    Wanted force_; ///< the thread's
};

} // namespace palpate::internal
