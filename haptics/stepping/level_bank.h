// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include <palpate/geometry/vec.h>

namespace palpate {

/// Energy that a proxy's drift below a level has taken out of the coupling, and with it how much of
/// that depth level-anchored planes may take back: lifting the proxy against the spring is work on
/// the hand, and a surface that gave more than it has taken would be a motor (numerics 3.6).
///
/// With d = n.(x - a) how far the proxy is in front of the probe, a movement of the proxy by r
/// along the normal n while the probe is held changes the coupling's energy by k (d r + r^2 / 2).
class LevelBank {
public:
    /// The surface is not touched: nothing has been taken, and the proxy is on no level. [loop]
    void clear() noexcept { *this = {}; }

    /// The level itself has moved to the proxy, by yielding.                             [loop]
    void level_moved() noexcept { depth_m_ = 0.0; }

    /// Whether lift() would change nothing and allow all of `depth_m`: no energy was taken, and the
    /// proxy is as far below the level as in the frame before, m, <= 0: on it or above.  [loop]
    bool is_level(double depth_m) const noexcept {
        return energy_j_ == 0.0 && depth_m == depth_m_ && depth_m <= 0.0;
    }
    /// A frame begins with the proxy `depth_m` below the level of normal n (m, < 0: above), and
    /// `ahead` = x0 - a of the probe, m, at coupling stiffness k in N/m, > 0. Books what the frame
    /// before came to; returns how far the proxy may be lifted in this one, m, >= 0.     [loop]
    double lift(double depth_m, const Vec3& normal, const Vec3& ahead, double stiffness) noexcept {
        const double sunk_m = depth_m - depth_m_;
        energy_j_ += stiffness * sunk_m * (glm::dot(normal, ahead_at_end_) + 0.5 * sunk_m);
        energy_j_ = std::max(energy_j_, 0.0);
        depth_m_ = depth_m;
        const double d = glm::dot(normal, ahead);
        return std::sqrt(d * d + 2.0 * energy_j_ / stiffness) - d;
    }

    /// The frame ends with the proxy `ahead` = x' - a of its probe, m.                   [loop]
    void end(const Vec3& ahead) noexcept { ahead_at_end_ = ahead; }

    double energy_j() const noexcept { return energy_j_; } ///< J, >= 0 [any]

private:
    double energy_j_ = 0.0;
    double depth_m_ = 0.0;   // at the last frame's start
    Vec3 ahead_at_end_{0.0}; // of the last frame
};

} // namespace palpate
