// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>

#include <palpate/geometry/range.h>
#include <palpate/haptics/effects/local_strength.h>

namespace palpate {

/// How a guide draws the proxy, and from where on.
struct GuideSettings {
    double strength_n = 1.0; ///< s: N, >= 0, may be infinite: it never slips, and never lets go
    /// It snaps on when the proxy is this near at a frame's start: m, > 0; infinite: always.
    double capture_m = std::numeric_limits<double>::infinity();
    StrengthOverField over = {}; ///< with a field: the strength by place, instead of strength_n
};

/// Whether a guide has the proxy: it snaps on within the capture distance and lets go beyond
/// kRelease times that, which a hand's tremor does not bridge. Decided at a frame's start and kept
/// during the frame. Where it snaps on, what the hand feels jumps by at most min(s, k capture): the
/// spring's energy is convex of modulus k, so a pull of at most s shifts its minimiser by at most
/// s / k, and nobody is drawn further than onto the guide. Where it lets go, by s at most.
class GuideCapture {
public:
    static constexpr double kRelease = 1.25;

    /// Throws std::invalid_argument on settings out of range.                          [setup]
    explicit GuideCapture(const GuideSettings& settings)
        : capture_m_(checked(settings).capture_m), strength_(settings.strength_n, settings.over) {}

    /// What it remembers from frame to frame.
    struct State {
        LocalStrength::State strength;
        bool holds = false;
    };
    State save_state() const noexcept { return {strength_.save_state(), holds_}; } ///< [setup]
    void restore_state(const State& state) noexcept {                              ///< [setup]
        strength_.restore_state(state.strength);
        holds_ = state.holds;
    }

    void restart() noexcept { ///< [loop]
        holds_ = false;
        strength_.restart();
    }
    void let_go() noexcept { holds_ = false; } ///< [loop]
    /// A frame begins at this distance from the guide, m.                              [loop]
    void begin(double distance_m) noexcept { holds_ = distance_m <= reach_m(); }
    bool holds() const noexcept { return holds_; }
    /// Beyond this distance the proxy is free, m.                                      [loop]
    double reach_m() const noexcept { return holds_ ? kRelease * capture_m_ : capture_m_; }
    /// A frame begins: the strength there, N, which is strength_n() from now on.        [loop]
    double strength_at(const FrameContext& frame) noexcept { return strength_.at(frame); }
    double strength_n() const noexcept { return strength_.now(); }
    std::uint64_t samples() const noexcept { return strength_.samples(); } ///< [any]

private:
    static const GuideSettings& checked(const GuideSettings& settings) {
        require("guide: strength_n", settings.strength_n, kNotNegativeOrInfinite);
        require("guide: capture_m", settings.capture_m, kPositiveOrInfinite);
        return settings;
    }

    double capture_m_; // first: what is wrong is said of the guide
    LocalStrength strength_;
    bool holds_ = false;
};

} // namespace palpate
