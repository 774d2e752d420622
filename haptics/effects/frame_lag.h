// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include <palpate/geometry/vec.h>
#include <palpate/haptics/effects/effect.h>

namespace palpate {

/// A force, or the strength of something that draws, as a frame finds it where it begins and keeps
/// it to its end. What it moves is the proxy, and so itself: where it changes by more than the
/// coupling's stiffness over the way that it moves the proxy, frames that took what they found
/// would overshoot in turns for ever. So a frame goes the part of the way
///   s' = s + (found - s) / (1 + g),   g = |change of what was found| / (k |way of the proxy|)
/// which is Newton's step to where force and place agree if g is that of the force itself. g is
/// measured from one frame to the next (whatever caused the change: then s' comes late, by about g
/// frames), and forgotten slowly as the proxy goes on, for kinks turn up again. With g = 0 what was
/// found is taken as it is. `Value`: double or Vec3, N; finite, or always the same. Not for two
/// threads at once.
template <class Value>
class FrameLag {
public:
    /// The next one is taken as it is found.                                            [loop]
    void restart() noexcept { begun_ = false; }

    /// A frame begins and finds `found` where it starts; what it is to take.             [loop]
    Value follow(const Value& found, const FrameContext& frame) noexcept {
        // What is found moves the proxy as many times as far as its gain is above 1.
        return follow(found, frame.start, frame.stiffness / std::max(1.0, frame.gain), frame.rests);
    }
    /// The same at `start` (m, scene frame) for a proxy that is held with `stiffness`, N/m, > 0.
    /// `rests`: FrameContext::rests. [loop]
    Value follow(const Value& found, const Vec3& start, double stiffness,
                 bool rests = false) noexcept {
        if (!begun_) gain_ = 0.0;
        if (begun_) {
            const double way = stiffness * glm::length(start - start_);
            if (way > kNoWay_n)
                gain_ = std::max(kRemembered * gain_, size(found - found_) / way);
            else if (rests || size(found - now_) <= kNoWay_n)
                return now_; // nothing to follow: it keeps its bits
        }
        now_ = begun_ && gain_ > 0.0 ? now_ + (found - now_) / (1.0 + gain_) : found;
        begun_ = true;
        found_ = found;
        start_ = start;
        return now_;
    }

private:
    // Below this a change of the proxy's place is rounding.
    static constexpr double kNoWay_n = 1e-9;
    // From frame to frame; at 0.9 no function of five nodes is known that goes on for ever.
    static constexpr double kRemembered = 0.9;

    static double size(double change) noexcept { return std::abs(change); }
    static double size(const Vec3& change) noexcept { return glm::length(change); }

    bool begun_ = false;
    double gain_ = 0.0;
    Value now_{0.0};
    Value found_{0.0};
    Vec3 start_{0.0};
};

} // namespace palpate
