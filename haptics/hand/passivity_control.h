// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include <palpate/geometry/vec.h>

namespace palpate {

/// Of PassivityControl, which says what the letters stand for.
struct PassivitySettings {
    double period_s = 1e-3;           ///< frame period T, s, > 0
    double force_n = 5.0;             ///< longest force F that is sent, N, > 0
    double stiffness_n_per_m = 500.0; ///< k of the coupling: what a force stands for, N/m, > 0
    double damping_n_s_per_m = 0.0;   ///< b of the device, declared, N s/m, >= 0: what it takes out
                                      ///< itself, and what may be added against a movement
    double delay_s = 0.0; ///< from a movement until the force that answers it is at work, beyond
                          ///< the frame itself, s, >= 0
    double bank_j = 2e-3; ///< what the hand may be given beyond what it has put in, J, > 0
    double reserve_j = 10e-3; ///< what it may have been given beyond that before it counts as a
                              ///< fault, J, > 0
    double active_w = 0.0;    ///< power that effects may give which push of themselves, W, >= 0

    bool operator==(const PassivitySettings&) const = default;
};

/// Bounds the energy that the hand gets back: an observer of the work of the forces that were sent,
/// and a controller that takes away what pushes along with a movement once it is used up (Hannaford
/// & Ryu 2002; the device's own damping pays for the holding of a force over a frame, as in Kim &
/// Ryu's energy bounding, 2010).
///
/// The account S begins with the bank B. With the force f that was at work while the probe moved
/// from x_(n-1) to x_n (a delayed one was sent earlier),
///   S_n = min(S_(n-1) - f.(x_n - x_(n-1)) + b v^2 T + P T,  B + U)
/// where U = |f|^2 / 2k is the energy of a coupling that wants f (times its share): more than that
/// and the bank cannot be asked back by what is passive, so an hour of friction does not pay for a
/// blow. The force that is sent next has
///   f.v <= S / max(5 ms, T),  or where S < 0 what is left of S after -b v^2
class PassivityControl {
public:
    /// Throws std::invalid_argument on settings out of range; of a delay beyond 30 T no more than
    /// that is counted on.                                                              [setup]
    explicit PassivityControl(const PassivitySettings& settings);

    /// Power that effects may give which push of themselves, W, >= 0, from now on.       [loop]
    void allow(double active_w) noexcept { settings_.active_w = active_w; }

    /// Nothing is known and nothing is at work: the account is the bank.                 [loop]
    void restart() noexcept;

    /// The probe is at `position` (m), moving at `velocity` (m/s), and `wanted` (N) is what the
    /// coupling asks for, of which `share` in [0, 1] is to be sent: books what the force at work
    /// did since the frame before.                                                       [loop]
    void observe(const Vec3& position, const Vec3& velocity, const Vec3& wanted,
                 double share = 1.0) noexcept;

    /// The account is below -reserve: what moves the probe outruns the controller.       [loop]
    bool exceeded() const noexcept { return account_j_ < -settings_.reserve_j; }

    /// What of a force (N) may be sent while the probe moves at `velocity`.              [loop]
    Vec3 control(const Vec3& force, const Vec3& velocity) const noexcept;

    /// What has been sent in this frame, N.                                              [loop]
    void sent(const Vec3& force) noexcept;

    double account_j() const noexcept { return account_j_; } ///< S, J                      [any]

private:
    static constexpr std::size_t kHistory = 32; // frames of a delay, with one to interpolate

    const Vec3& sent_before(std::size_t frames) const noexcept {
        return sent_[(frame_ + kHistory - frames) % kHistory];
    }
    double spring_energy(const Vec3& wanted) const noexcept;
    double highest_spring_energy() const noexcept;
    double work_under_way(const Vec3& velocity) const noexcept;

    PassivitySettings settings_;
    std::size_t delay_frames_ = 0; // whole frames of the delay
    double delay_rest_ = 0.0;      // and the share of another, [0, 1)
    double account_j_ = 0.0;
    bool placed_ = false; // position_ is one
    Vec3 position_{0.0};
    std::size_t frame_ = 0;                 // index of the newest in both rings
    std::array<Vec3, kHistory> sent_{};     // N
    std::array<double, kHistory> spring_{}; // J: what the coupling stood for
};

} // namespace palpate
