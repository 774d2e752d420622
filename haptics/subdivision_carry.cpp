// SPDX-License-Identifier: Apache-2.0
// How the proxy gets from one place to the next: along chords that every surface certifies, or led
// by one surface.
#include <palpate/haptics/subdivision.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <palpate/haptics/frame_flags.h>

namespace palpate {
namespace {

// A blocked chord is halved down to 1/16 before it is given up (contact.md 1.2, step 7).
constexpr double kShortestShare = 1.0 / 16.0;

} // namespace

/// Follows the chord as far as every surface's certificate holds that does not yield in this
/// sub-step.
Vec3 Subdivision::carried(const Vec3& from, const Vec3& to, SubdivisionResult& result) noexcept {
    if (!is_a_place(to)) {
        result.flags |= kForceNotFinite;
        return accepted(from, result);
    }
    double stopped_at =
        1.0; // by a surface met on the way: it offers its plane at the next gathering
    double blocked_at = 1.0; // by one that is felt already
    bool bends = false;      // what stopped it is no obstacle
    SurfaceContact* blocking = nullptr;
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        if (any_state(i, MultiplierState::saturated)) {
            result.open |= bit_of(i, true); // its certificate is lifted for this chord
            continue;
        }
        const Chord chord = surfaces_[i]->carry(from, to);
        if (!chord.engaged) {
            if (chord.fraction < stopped_at) bends = chord.bends;
            stopped_at = std::min(stopped_at, chord.fraction);
        } else if (chord.fraction < blocked_at) {
            blocked_at = chord.fraction;
            blocking = surfaces_[i];
        }
    }
    if (stopped_at >= 1.0 && blocked_at >= 1.0) return accepted(to, result);
    const Vec3 chord = to - from;
    if (stopped_at < blocked_at) {
        if (bends) ++bends_;
        return accepted(from + stopped_at * chord, result);
    }

    double share = 0.5;
    while (share >= blocked_at && share > kShortestShare)
        share *= 0.5;
    if (share < blocked_at) return accepted(from + share * chord, result);
    const std::optional<Vec3> reached = blocking->obstructed(from, to, blocked_at);
    return accepted(reached.value_or(from), result);
}

/// The surface that alone holds the proxy and can lead it, if there is one.
SurfaceContact* Subdivision::leading_surface() const noexcept {
    if (primitives_.planes().size() != contacts_.size() || primitives_.has_tethers())
        return nullptr;                                            // an effect holds it, too
    if (contacts_.size() != first_contact_.back()) return nullptr; // so does a magnet
    SurfaceContact* leading = nullptr;
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        if (first_contact_[i] == first_contact_[i + 1]) continue;
        if (leading || friction_.rubs(i) || !surfaces_[i]->slides() ||
            any_state(i, MultiplierState::saturated))
            return nullptr;
        leading = surfaces_[i];
    }
    return leading;
}

/// The probe, shifted by forces and springs.
Vec3 Subdivision::pull() const noexcept { return primitives_.pull(frame_.probe, frame_.stiffness); }

/// Whether an adaptive frame is over: the surface that leads held the proxy and still does, could
/// neither yield nor open, and no effect could pull elsewhere from there. Its planes there would
/// tell no more.
bool Subdivision::rests_firmly(const SurfaceContact& surface, const Vec3& proxy) const noexcept {
    return settings_.method == SteppingMethod::adaptive && converged_ && effects_.empty() &&
           solution_.planes[0].state == MultiplierState::active &&
           glm::length(pull() - proxy) > settings_.tolerance_m &&
           std::isinf(contacts_[0].plane.strength_n) && std::isinf(surface.opens_above_n());
}

/// Where a surface leads the proxy towards the probe, shifted by the forces, or towards this
/// sub-step's share of the way there; as far as the other surfaces' certificates hold.
Vec3 Subdivision::led(SurfaceContact& surface, Vec3 proxy, std::uint32_t steps_left,
                      SubdivisionResult& result) noexcept {
    Vec3 pull = this->pull();
    if (settings_.method != SteppingMethod::adaptive) {
        pull = proxy + (pull - proxy) / (steps_left + 1.0); // eq. (9)
        ++legs_left_; // every share has a leg of its own: kMostLegs are for corners between
    }
    if (!is_a_place(pull)) {
        result.flags |= kForceNotFinite | kStalled;
        return proxy;
    }
    for (; legs_left_ > 0; --legs_left_) {
        const SlideLeg leg = surface.slide(proxy, pull);
        if (leg.end == SlideLeg::End::rests) {
            converged_ = true;
            return proxy;
        }
        if (leg.end == SlideLeg::End::stuck) {
            result.flags |= kStalled;
            return proxy;
        }
        Chord chord;
        for (SurfaceContact* other : surfaces_) {
            if (other == &surface) continue;
            const Chord theirs = other->carry(proxy, leg.corner);
            if (theirs.fraction < chord.fraction) chord = theirs;
        }
        if (chord.fraction < 1.0) {
            if (chord.bends) ++bends_;
            return accepted(proxy + chord.fraction * (leg.corner - proxy), result);
        }
        proxy = accepted(leg.corner, result);
    }
    if (settings_.method == SteppingMethod::adaptive || steps_left == 0)
        result.flags |= kEvaluationCap; // otherwise the next share begins where this one ended
    return proxy;
}

Vec3 Subdivision::accepted(const Vec3& proxy, SubdivisionResult& result) noexcept {
    if (proxy == path_.back()) {
        // In vain once may bring in a new plane; adaptive frames then try another way. After that
        // nothing will change any more.
        const bool has_another = settings_.method == SteppingMethod::adaptive;
        if (++unmoved_ >= kTriesToMove - (has_another ? 0 : 1)) result.flags |= kStalled;
        return proxy;
    }
    unmoved_ = 0;
    ++result.sub_steps;
    path_.push_back(proxy);
    return proxy;
}

/// Whether a proxy is where no frame ends that comes to its end: the balance is no further from the
/// pull than the frame's start, but for what the start is lifted or drawn by. What holds the proxy
/// twice, as two modes of one vector field that never slip, may meet at any angle on the way there.
bool Subdivision::is_astray(const Vec3& proxy) const noexcept {
    const double lift_m = frame_.force_limit_n / frame_.stiffness;
    return glm::length(proxy - pull()) > glm::length(frame_.start - pull()) + lift_m;
}

/// An adaptive frame that ends at its cap ends on the level at least, and not astray.
Vec3 Subdivision::settled(Vec3 proxy, SubdivisionResult& result) noexcept {
    if (settings_.method != SteppingMethod::adaptive || converged_ || primitives_.is_free())
        return proxy;
    if (is_astray(proxy)) proxy = carried(proxy, frame_.start, result);
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        if (any_state(i, MultiplierState::saturated) || !any_state(i, MultiplierState::active) ||
            sunk_m_[i] > 0.0)
            continue;
        if (const std::optional<Vec3> level = surfaces_[i]->settle(proxy))
            proxy = carried(proxy, *level, result);
    }
    return proxy;
}

} // namespace palpate
