// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>

namespace palpate {

/// What the strengths, forces and damping of an effect are multiplied with in one frame.
struct Gain {
    double value = 1.0;         ///< g, [0, GainRamp::kHighest]; 0: off, 1: as the scene says
    double force_limit_n = 5.0; ///< F: what hard things are measured by below 1, N, > 0
    bool moving = false;        ///< another value than in the frame before, or on its way there
    std::optional<double> strength_here_n = {}; ///< N: the strength at the proxy, where it depends
                                                ///< on the place; replaces the constant one
    double most_spring_n_per_m =
        std::numeric_limits<double>::infinity(); ///< of what is a spring, N/m, >= 0

    bool off() const noexcept { return value == 0.0; } ///< nothing is left of the effect  [any]

    /// A strength in N, >= 0, may be infinite, with this gain.                          [any]
    ///   s(g) = g s, for g < 1 at most F g / (1 - g)
    /// What is hard fades, too: as far as the device can show it, s(g) <= F, no faster than with
    /// 4 F per unit of gain.
    double strength_n(double own_n) const noexcept {
        if (off()) return 0.0;
        const double scaled_n = value * strength_here_n.value_or(own_n);
        return value < 1.0 ? std::min(scaled_n, force_limit_n * value / (1.0 - value)) : scaled_n;
    }
    /// The stiffness of a spring, N/m, >= 0, with this gain.                             [any]
    ///   c(g) = g c, at most most_spring_n_per_m
    double spring_n_per_m(double own_n_per_m) const noexcept {
        return std::min(value * own_n_per_m, most_spring_n_per_m);
    }
};

/// A gain that any thread may set while one loop follows it, without a lock. It moves by 1 in
/// kSecondsPerUnit at most, linearly, and at the beginnings of frames alone: no frame sees it
/// change. No force of a hand that is held steps because of it by more than period /
/// kSecondsPerUnit times what it is at gain 1 or, of what is stronger than the force limit F, times
/// 4 F (Gain::strength_n); but where a guide or a magnet lets go for it, or a membrane opens.
class GainRamp {
public:
    static constexpr double kHighest = 10.0;        ///< no unit
    static constexpr double kSecondsPerUnit = 0.05; ///< from on to off, s

    GainRamp() noexcept = default;
    /// Where the other one is and goes; neither may be in use.                           [setup]
    GainRamp(const GainRamp& other) noexcept
        : wanted_(other.wanted_.load(std::memory_order_relaxed)), now_(other.now_),
          moving_(other.moving_), jumped_(other.jumped_) {}

    /// Where it is and where it goes, as a value.
    struct State {
        double wanted = 1.0; ///< where it goes, [0, kHighest]
        double now = 1.0;    ///< where it is, [0, kHighest]
        bool moving = false; ///< it moved in the last frame
        bool jumped = false; ///< jump() was called since the last frame
    };
    State save_state() const noexcept { ///< [setup]
        return {wanted_.load(std::memory_order_relaxed), now_, moving_, jumped_};
    }
    /// Of a set() at the same time, one of the two holds.                                [setup]
    void restore_state(const State& state) noexcept {
        wanted_.store(state.wanted, std::memory_order_relaxed);
        now_ = state.now;
        moving_ = state.moving;
        jumped_ = state.jumped;
    }

    static bool in_range(double gain) noexcept {
        return gain >= 0.0 && gain <= kHighest;
    } ///< [any]

    /// Where it goes from the next frame on, [0, kHighest].                              [any]
    void set(double gain) noexcept { wanted_.store(gain, std::memory_order_relaxed); }

    /// Whether advance() would change anything, or has since the frame before.           [loop]
    bool moves() const noexcept {
        return moving_ || jumped_ || now_ != wanted_.load(std::memory_order_relaxed);
    }
    /// A frame of `period_s` begins, s: a step of the way; at 0 s it goes on, and nothing changes.
    /// True when anything changed since the frame before.                               [loop]
    bool advance(double period_s) noexcept {
        // Once, as another thread may set it meanwhile.
        const double wanted = wanted_.load(std::memory_order_relaxed);
        if (!(period_s > 0.0)) return false; // within a frame
        if (!moving_ && !jumped_ && now_ == wanted) return false;
        jumped_ = false;
        const double longest = period_s / kSecondsPerUnit;
        const double way = wanted - now_;
        now_ = std::abs(way) <= longest ? wanted : now_ + std::copysign(longest, way);
        moving_ = way != 0.0;
        return true;
    }
    /// A trial begins: it is where it goes at once.                                      [loop]
    void jump() noexcept {
        now_ = wanted_.load(std::memory_order_relaxed);
        moving_ = false;
        jumped_ = true;
    }

    /// It is where the other one is, and goes where it was set to go itself.             [loop]
    void go_on_from(const GainRamp& before) noexcept {
        now_ = before.now_;
        moving_ = true;
        jumped_ = true;
    }
    double wanted() const noexcept { return wanted_.load(std::memory_order_relaxed); } ///< [any]

    /// For strengths on a device that shows `force_limit_n` > 0 at most.                 [loop]
    Gain gain(double force_limit_n) const noexcept { return {now_, force_limit_n, moving_}; }
    /// The same for springs, in a frame of `period_s` > 0 of a coupling of `stiffness`, k in N/m,
    /// > 0.                                                                              [loop]
    /// The proxy relaxes against a spring c: in each frame k / (k + c) of what is felt is lost. On
    /// the way between 0 and 1, however it is set, that is kept at 4 period / kSecondsPerUnit at
    /// least: a stiffer one would hold nearly all until its last frame. e^-4 of it, 2 %, is left
    /// there. Springs that move together share it (PrimitiveSet::add_spring).
    Gain gain(double force_limit_n, double period_s, double stiffness) const noexcept {
        Gain now = gain(force_limit_n);
        if (moving_ && now_ < 1.0)
            now.most_spring_n_per_m =
                stiffness * std::max(0.0, kSecondsPerUnit / (4.0 * period_s) - 1.0);
        return now;
    }
    double value() const noexcept { return now_; } ///< in this frame                      [loop]

private:
    static_assert(std::atomic<double>::is_always_lock_free);
    std::atomic<double> wanted_{1.0};
    double now_ = 1.0;
    bool moving_ = false;
    bool jumped_ = false;
};

} // namespace palpate
