// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <palpate/haptics/effects/effect.h>

namespace palpate {
/// How a struck surface rings.
struct ContactVibrationSettings {
    double amplitude_n_s_per_m = 5.0; ///< A: N per m/s of approach, >= 0, finite
    double frequency_hz = 150.0;      ///< f: Hz, > 0; a loop refuses half its rate, and more
    double decay_s = 0.02;            ///< tau: s, > 0, finite
    double most_n = 2.0;              ///< the force is never above this, N, >= 0, finite
    std::uint64_t surfaces = ~std::uint64_t{0}; ///< bits of FrameOutcome::felt that it answers
};

/// What a struck object rings with, so that bone feels harder than a coupling can be: a decaying
/// sinusoid after each contact that begins (Wellman & Howe 1995; Okamura, Cutkosky & Dennerlein
/// 2001),
///   f(t) = A v exp(-t / tau) sin(2 pi f t) n
/// with n the direction in which the coupling pushes back at the impact's frame, v the probe's
/// speed against it, m/s, of that frame's movement, and t the time since, in nominal periods.
/// It acts on the device beside the coupling: a surface that holds the proxy would swallow it.
///
/// Impacts superpose, of the same surface too, as on a struck object: what rings is one damped
/// oscillator with three axes. A new impact begins at sin 0, so the force never jumps. The
/// oscillator's amplitude is bounded by `most_n`, is raised by an impact by at most A v, and decays
/// always; surfaces hit in the same frame are one impact. Of a trial's first frame, of the first
/// since it was switched on and of the first after a silence of the device, no speed is known: what
/// is felt there already was not struck.
class ContactVibration final : public Effect {
public:
    /// Throws std::invalid_argument on settings out of range.                          [setup]
    explicit ContactVibration(const ContactVibrationSettings& settings);

    void restart(const Vec3& proxy) noexcept override;
    void begin(const FrameContext& frame) noexcept override;
    void gather(const Vec3&, PrimitiveSet&) noexcept override {}
    void commit(const FrameOutcome& outcome) noexcept override;
    Vec3 device_force_n() const noexcept override { return now_.sine_n; }
    bool is_active() const noexcept override { return true; }
    bool only_pushes() const noexcept override { return true; }
    double highest_tone_hz() const noexcept override { return settings_.frequency_hz; }
    std::size_t most_primitives() const noexcept override { return 0; }
    QueryCount queries() const noexcept override { return {}; }
    std::any save_state() const override { return now_; }
    void restore_state(const std::any& state) override {
        now_ = std::any_cast<const State&>(state);
    }

private:
    /// What it remembers from frame to frame.
    struct State {
        bool first = true;      // no frame since restart()
        std::uint64_t felt = 0; // at the last frame's end
        Vec3 probe{0.0};        // of this frame
        // The oscillator: A v exp(-t/tau) times sin and cos of 2 pi f t, N.
        Vec3 sine_n{0.0};
        Vec3 cosine_n{0.0};
    };

    void tune(double period_s) noexcept;
    void strike(const Vec3& impact_n) noexcept;

    ContactVibrationSettings settings_;
    State now_;
    Vec3 velocity_{0.0}; // of the probe since the last frame, m/s
    // What a period turns the oscillator by.
    double period_s_ = 0.0;
    double turn_sine_ = 0.0;
    double turn_cosine_ = 0.0;
};

} // namespace palpate
