// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <any>
#include <cmath>
#include <cstddef>
#include <numbers>

#include <palpate/haptics/effects/effect.h>

/// A wave that runs along x and pushes across it, along z:
///   d = A sin(2 pi (f t - x0 / w))
/// in N, with x0 the proxy at the frame's start and t counted in frames, so that a run repeats.
class Wave final : public palpate::Effect {
public:
    static constexpr double kAmplitude_n = 0.5;
    static constexpr double kFrequency_hz = 2.0;
    static constexpr double kWavelength_m = 0.1;

    static double force_n(double time_s, double x_m) {
        return kAmplitude_n *
               std::sin(2.0 * std::numbers::pi * (kFrequency_hz * time_s - x_m / kWavelength_m));
    }

    void restart(const palpate::Vec3&) noexcept override { time_s_ = 0.0; }
    void begin(const palpate::FrameContext& frame) noexcept override {
        felt_n_ = {0.0, 0.0, force_n(time_s_, frame.start.x)};
        time_s_ += frame.period_s;
    }
    void gather(const palpate::Vec3&, palpate::PrimitiveSet& primitives) noexcept override {
        primitives.add_force(felt_n_);
    }
    // It pushes a hand that did nothing: a device with motors has to know by how much.
    double unasked_force_n() const noexcept override { return kAmplitude_n; }
    // And the push moves while the hand holds still: it is not to be calmed as a proxy is that goes
    // to and fro for want of a balance.
    bool is_active() const noexcept override { return true; }
    std::size_t most_primitives() const noexcept override { return 0; } // a force needs no room
    palpate::QueryCount queries() const noexcept override { return {}; }
    // Its time moves from frame to frame, so it is a part of HapticLoop::save() and restore().
    std::any save_state() const override { return time_s_; }
    void restore_state(const std::any& state) override { time_s_ = std::any_cast<double>(state); }

private:
    double time_s_ = 0.0;
    palpate::Vec3 felt_n_{0.0};
};
