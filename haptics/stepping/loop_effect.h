// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <any>
#include <typeinfo>

#include <palpate/haptics/effects/effect.h>
#include <palpate/haptics/solver/gain.h>

namespace palpate {

/// An effect with its gain, as one loop feels it. At gain 0 the effect gets no frames. Only
/// GainRamp::set() may be called from a second thread.
class LoopEffect {
public:
    /// The effect must outlive this.                                                     [setup]
    explicit LoopEffect(Effect& effect) noexcept : effect_(&effect) {}

    /// What it remembers from frame to frame.
    struct State {
        const std::type_info* kind = nullptr; ///< of the effect
        std::any effect;
        GainRamp::State gain;
    };
    State save_state() const { ///< between frames                                       [setup]
        return {&typeid(*effect_), effect_->save_state(), gain_.save_state()};
    }
    /// Whether it is of the same kind of effect.                                         [any]
    bool takes(const State& state) const noexcept { return *state.kind == typeid(*effect_); }
    /// Between frames, of one that takes() it and was made alike.                        [setup]
    void restore_state(const State& state) {
        effect_->restore_state(state.effect);
        gain_.restore_state(state.gain);
    }

    GainRamp& gain() noexcept { return gain_; } ///< of all that it does                   [any]
    bool is_on() const noexcept { return gain_.value() > 0.0; } ///< in this frame         [loop]
    bool is_as_set() const noexcept { return gain_.value() == 1.0; } ///< in this frame    [loop]

    /// A new trial: the proxy is at a new place.                                         [loop]
    void restart(const Vec3& proxy) noexcept {
        effect_->restart(proxy);
        gain_.jump();
    }
    /// A frame begins: its gain takes a step; whether it moved. What is switched on begins as at a
    /// new trial.                                                                        [loop]
    bool follow_gain(const FrameContext& frame) noexcept {
        const bool was_on = is_on();
        const bool moved = gain_.advance(frame.period_s);
        if (is_on() && !was_on) effect_->restart(frame.start);
        return moved;
    }

    /// Goes on with the same effect as `before` in another loop, and from its gain.      [loop]
    void go_on_from(const LoopEffect& before) noexcept { gain_.go_on_from(before.gain_); }

    // The rest is as Effect says, with the gain, and nothing where it is off. All [loop].

    void begin(const FrameContext& frame) noexcept {
        if (!is_on()) return;
        if (is_as_set()) return effect_->begin(frame);
        FrameContext seen = frame;
        seen.gain = gain_.value();
        effect_->begin(seen);
    }
    /// `frame`: its strengths are scaled by the force limit, its springs by the coupling.
    void gather(const Vec3& proxy, const FrameContext& frame, PrimitiveSet& primitives) noexcept {
        if (!is_on()) return;
        primitives.set_gain(gain_.gain(frame.force_limit_n, frame.period_s, frame.stiffness));
        effect_->gather(proxy, primitives);
    }
    void solved(const Vec3& end) noexcept {
        if (is_on()) effect_->solved(end);
    }
    Vec3 within(const Vec3& wanted) const noexcept {
        return is_on() ? effect_->within(wanted) : wanted;
    }
    void commit(const FrameOutcome& outcome) noexcept {
        if (is_on()) effect_->commit(outcome);
    }
    /// Adds Effect::device_force_n(), N.
    void add_device_force(Vec3& force_n) const noexcept {
        if (is_on()) force_n += gain_.value() * effect_->device_force_n();
    }
    double unasked_force_n() const noexcept {
        return is_on() ? gain_.value() * effect_->unasked_force_n() : 0.0;
    }
    bool is_active() const noexcept { return is_on() && effect_->is_active(); }

private:
    Effect* effect_;
    GainRamp gain_;
};

} // namespace palpate
