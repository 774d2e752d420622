// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <palpate/geometry/vec.h>
#include <palpate/haptics/hand/passivity_control.h>
#include <palpate/haptics/stepping/frame_flags.h>

namespace palpate {

/// Whether there is a hand that a force could hurt.
enum class ForceFeedback {
    none,  ///< forces are computed and forgotten: a path, a recording; limits alone
    motors ///< the whole chain
};

/// Of SafetyChain: limits of every force, and what motors need beyond them.
struct SafetySettings {
    ForceFeedback feedback = ForceFeedback::none; ///< none: limits alone
    double force_n = 5.0;                         ///< longest force, N, > 0
    double slew_n_per_s = 2000.0;                 ///< fastest change, N/s, > 0
    double period_s = 1e-3;                       ///< nominal frame period, s, > 0

    // With motors:
    double small_force_n = 0.2; ///< what is wanted must be this small before any is sent, N, > 0;
                                ///< more where effects push unasked, see expect()
    double calm_s = 0.01;       ///< for this long, s, >= 0
    double ramp_s = 0.25;       ///< then it takes this long to the whole force, s, > 0
    double soften_s =
        0.02; ///< time constant of the stiffness while energy has to be bounded, s, > T
    double stiffen_s = 5.0;        ///< then it takes this long from none to the whole one, s, > 0
    double fade_s = 4e-3;          ///< from the longest force to none after a fault, s, > 0
    double fastest_m_per_s = 10.0; ///< a probe that is faster has jumped, m/s, > 0
    double unasked_w = 0.5; ///< power that is allowed while effects push of themselves, W, >= 0: a
                            ///< weight of 1 N let down at 0.5 m/s
    PassivitySettings passivity; ///< its period and force are taken from here

    bool operator==(const SafetySettings&) const = default;
};

/// Last before the device, always on. What leaves here is, in this order,
///   1 finite; a force that is no number, a probe that jumps and an account of energy that is
///     overdrawn are faults: the force fades to zero and everything begins with 2;
///   2 zero until what is wanted has been small, then ramped in;
///   3 bounded in the energy that the hand gets back (PassivityControl); while that takes force
///     away the coupling becomes softer, c' = c (1 - T / soften_s) of its stiffness, and slowly
///     stiff again afterwards: a loop that shakes finds the stiffness that it can hold;
///   4 no longer than the limit, and no further from what left before than the slew limit allows
///     in one period.
/// Without motors: finite and 4 alone.
///
/// The last word, whatever came in and whatever 1 to 4 made of it: what is sent is finite, no
/// longer than force_n, and no further from the force that was sent last than slew_n_per_s T;
/// towards zero, after a fault, as fast as fade_s says where that is sooner. A force that is not so
/// is not sent: the last one fades instead, flag force_not_finite.
class SafetyChain {
public:
    /// Throws std::invalid_argument on settings out of range.                           [setup]
    explicit SafetyChain(const SafetySettings& settings);

    /// What effects push unasked in this frame, N, >= 0, and whether any is active: what they push
    /// counts as a small force, with a margin, and they are allowed some power. Holds until it is
    /// said again.                                                                       [loop]
    void expect(double unasked_n, bool active) noexcept;

    /// The force to send for a wanted one, N, with the probe (m) moving at `velocity` (m/s), of
    /// which none need be numbers; says in `flags` what it did. [loop]
    Vec3 send(const Vec3& wanted, const Vec3& probe, const Vec3& velocity,
              std::uint32_t& flags) noexcept;

    /// The force to send in a frame whose probe cannot be trusted, N: towards zero, which is
    /// reached within fade_s, or as fast as the slew limit allows where that is sooner. Afterwards
    /// send() waits again. Without motors at the slew limit. [loop]
    Vec3 fade(std::uint32_t& flags) noexcept;

    const SafetySettings& settings() const noexcept { return settings_; } ///< [any]
    double force_n() const noexcept { return settings_.force_n; } ///< longest force, N  [any]
    const Vec3& sent() const noexcept { return sent_; } ///< last force, N                  [any]
    /// Energy that the hand may still be given, J.                                       [any]
    double account_j() const noexcept { return passivity_.account_j(); }

private:
    Vec3 chosen(const Vec3& wanted, const Vec3& probe, const Vec3& velocity,
                std::uint32_t& flags) noexcept;
    bool is_well_within(const Vec3& wanted) const noexcept;
    Vec3 after_fault() noexcept;
    Vec3 confirmed(const Vec3& force, const Vec3& before, std::uint32_t& flags) noexcept;
    bool is_allowed(const Vec3& force, const Vec3& before) const noexcept;
    Vec3 limited(Vec3 wanted, std::uint32_t& flags) noexcept;
    Vec3 shortened(const Vec3& wanted, std::uint32_t& flags) const noexcept;
    Vec3 slewed(const Vec3& wanted, std::uint32_t& flags) noexcept;
    Vec3 faded() noexcept;
    double fading_step_n() const noexcept;
    /// Of the slew limit, N.
    double longest_step_n() const noexcept { return settings_.slew_n_per_s * settings_.period_s; }
    bool jumped(const Vec3& probe, const Vec3& velocity) const noexcept;
    bool waits(double wanted_n) noexcept;
    double next_share(std::uint32_t& flags) noexcept;

    SafetySettings settings_;
    PassivityControl passivity_;
    double surely_short_n2_, surely_slow_n2_; // N^2: is_well_within()
    double small_force_n_;                    // with what effects push
    Vec3 sent_{0.0};
    Vec3 probe_{0.0};
    bool placed_ = false;          // probe_ is one
    bool waiting_ = true;          // for a small force
    double calm_s_ = 0.0;          // since when what is wanted has been small, while waiting
    double ramp_ = 0.0;            // share of the force that is sent, [0, 1]
    double stiffness_share_ = 1.0; // of the coupling's, (0, 1]
};

} // namespace palpate
