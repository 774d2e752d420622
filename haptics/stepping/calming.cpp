// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/stepping/calming.h>

#include <algorithm>

namespace palpate {
namespace {

// A proxy that goes so many times as far as the probe does, and back, does not follow it.
constexpr double kFollows = 8.0;
// It has turned back where a step goes against the one before and is not much shorter: what halves
// from frame to frame comes to rest by itself.
constexpr double kAgainst = -0.25; // cosine
constexpr double kNoShorter = 0.5;
// Or where its way is so many times as long as where it has led to: it goes round.
constexpr double kRound = 4.0;
// A frame that walks so many times as far as it gets is stuck between its own steps. One that does
// get on, though in zigzag, is let be; and so are a few of them, which may precede rest.
constexpr double kInVain = 100.0;
// With each turn back; from the coupling's own stiffness on.
constexpr double kStiffer = 4.0;
// With each frame after the first of these: what would go on for ever is over in some hundred.
constexpr double kStifferWithTime = 1.02;
// With it a millimetre is a nanometre: what moves then is constraints that contradict each other.
constexpr double kStiffest = 1e6; // of the coupling's
// On so long a way of the probe three quarters of the spring are forgotten.
constexpr double kForgets = 10e-6; // m
// A frame that goes so small a share of the loop's tolerance hardly moves the proxy: five
// micrometres in a second at 1 kHz and 0.1 um.
constexpr double kStill = 0.05;
// So many of them are rest: longer than anything takes to begin that a frame remembers of the one
// before (FrameLag: 0.9 a frame).
constexpr int kStillFrames = 32;
// Under a held probe a proxy may rest, go on, rest where it has been, and so on for ever: after so
// many returns it stays. What comes nearer to its balance by half with each of them has then made
// 99.6 percent of its way; and what creeps on, as through a viscous medium, does not return.
constexpr int kMostReturns = 8;
// Below it nothing is left to damp.
constexpr double kWeakest = 1e-3; // of the coupling's

} // namespace

void Calming::begin(const FrameContext& frame) noexcept {
    const bool was_held = held_;
    held_ = begun_ && frame.probe == frame_.probe && frame.start == end_ &&
            frame.stiffness == frame_.stiffness;
    probe_step_m_ = begun_ ? glm::length(frame.probe - frame_.probe) : 0.0;
    if (!begun_) look_anew(frame.start);
    begun_ = true;
    frame_ = frame;
    if (!held_) {
        still_ = returns_ = 0;
        first_rest_.reset();
    }
    if (held_ && !was_held) look_anew(frame.start);
    const double kept = 1.0 + probe_step_m_ / kForgets;
    damping_ /= kept * kept;
    if (held_ && !stopped())
        damping_ = std::min(kStifferWithTime * damping_, kStiffest * frame.stiffness);
    if (damping_ < kWeakest * frame.stiffness) damping_ = 0.0;
    spring_n_per_m_ = damping_;
}

void Calming::look_anew(const Vec3& proxy) noexcept {
    from_ = proxy;
    way_m_ = probe_way_m_ = 0.0;
}

bool Calming::turned_back(const Vec3& step) const noexcept {
    const double length = glm::length(step), before = glm::length(last_step_);
    if (length > kFollows * probe_since_m_ && length > kNoShorter * before && before > 0.0 &&
        glm::dot(step, last_step_) < kAgainst * length * before)
        return true;
    return way_m_ > kRound * glm::length(frame_.start + step - from_) + kFollows * probe_way_m_;
}

bool Calming::stopped() const noexcept {
    return held_ && (still_ >= kStillFrames || damping_ >= kStiffest * frame_.stiffness);
}

bool Calming::rests(const Vec3& asked) noexcept {
    if (!stopped()) {
        rested_ = 0;
        return false;
    }
    rested_ = std::min(rested_ + 1, 3); // a hand may rest for days
    if (rested_ <= 2) asked_ = asked;
    if (glm::length(asked - asked_) <= tolerance_m_ || has_come_back_too_often()) return true;
    wake();
    return false;
}

bool Calming::has_come_back_too_often() const noexcept {
    return stopped() && returns_ >= kMostReturns;
}

/// The proxy, at the frame's start, has been at rest, and goes on.
void Calming::wake() noexcept {
    still_ = rested_ = 0;
    damping_ = 0.0;
    if (!first_rest_) {
        first_rest_ = frame_.start;
        farthest_m_ = 0.0;
        return;
    }
    const double away_m = glm::length(frame_.start - *first_rest_);
    if (away_m <= farthest_m_ + tolerance_m_)
        ++returns_;
    else
        farthest_m_ = away_m;
}

void Calming::end(const Vec3& proxy, double walked_m, double slowness) noexcept {
    const Vec3 step = proxy - frame_.start;
    end_ = proxy;
    const bool hardly = slowness * glm::length(step) < kStill * tolerance_m_;
    still_ = hardly ? std::min(still_ + 1, kStillFrames) : 0;
    probe_since_m_ += probe_step_m_;
    probe_way_m_ += probe_step_m_;
    if (step == Vec3{0.0}) return;
    way_m_ += glm::length(step);
    in_vain_ = held_ && !hardly && walked_m > kInVain * glm::length(step) ? in_vain_ + 1 : 0;
    if (turned_back(step) || in_vain_ > kStillFrames) {
        damping_ = std::clamp(kStiffer * damping_, frame_.stiffness, kStiffest * frame_.stiffness);
        look_anew(proxy);
    } else if (way_m_ <= kFollows * probe_way_m_) {
        look_anew(proxy);
    }
    last_step_ = step;
    probe_since_m_ = 0.0;
}

} // namespace palpate
