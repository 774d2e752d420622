// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/hand/safety_chain.h>

#include <algorithm>
#include <cmath>

#include <palpate/geometry/range.h>

namespace palpate {
namespace {

constexpr double kUnaskedMargin = 1.2;   // over forces that act of themselves: calm is above them
constexpr double kRounding = 1.0 + 1e-9; // what some roundings of a length come to, and far more
constexpr double kSurely = 1.0 - 1e-6;   // of a limit's square: no rounding bridges that
constexpr double kBelow = 1.0 - 1e-15;   // more than two lengths' roundings, each 4 of 1.1e-16

/// Throws std::invalid_argument on settings out of range.
const SafetySettings& checked(const SafetySettings& settings) {
    require("safety: force_n", settings.force_n, kPositive);
    require("safety: slew_n_per_s", settings.slew_n_per_s, kPositive);
    require("safety: period_s", settings.period_s, kPositive);
    require("safety: small_force_n", settings.small_force_n, kPositive);
    require("safety: calm_s", settings.calm_s, kNotNegative);
    require("safety: ramp_s", settings.ramp_s, kPositive);
    require("safety: soften_s", settings.soften_s,
            {settings.period_s, kPositive.high, Range::Ends::open});
    require("safety: stiffen_s", settings.stiffen_s, kPositive);
    require("safety: fade_s", settings.fade_s, kPositive);
    require("safety: fastest_m_per_s", settings.fastest_m_per_s, kPositive);
    require("safety: unasked_w", settings.unasked_w, kNotNegative);
    return settings;
}

PassivitySettings passivity_of(const SafetySettings& settings) noexcept {
    PassivitySettings passivity = settings.passivity;
    passivity.period_s = settings.period_s;
    passivity.force_n = settings.force_n;
    return passivity;
}

} // namespace

SafetyChain::SafetyChain(const SafetySettings& settings)
    : settings_(checked(settings)), passivity_(passivity_of(settings)),
      surely_short_n2_(kSurely * settings.force_n * settings.force_n),
      surely_slow_n2_(kSurely * longest_step_n() * longest_step_n()),
      small_force_n_(settings.small_force_n) {}

void SafetyChain::expect(double unasked_n, bool active) noexcept {
    // Written so that what is no number is nothing.
    small_force_n_ = std::max(settings_.small_force_n, kUnaskedMargin * unasked_n);
    const double own_w = active || unasked_n > 0.0 ? settings_.unasked_w : 0.0;
    passivity_.allow(std::max(settings_.passivity.active_w, own_w));
}

Vec3 SafetyChain::send(const Vec3& wanted, const Vec3& probe, const Vec3& velocity,
                       std::uint32_t& flags) noexcept {
    if (settings_.feedback == ForceFeedback::none && is_well_within(wanted)) return sent_ = wanted;
    const Vec3 before = sent_;
    return confirmed(chosen(wanted, probe, velocity, flags), before, flags);
}

Vec3 SafetyChain::fade(std::uint32_t& flags) noexcept {
    const Vec3 before = sent_;
    return confirmed(settings_.feedback == ForceFeedback::none ? limited(Vec3{0.0}, flags)
                                                               : after_fault(),
                     before, flags);
}

/// Whether it is so far below both limits that nothing has to be taken from it, whatever rounds.
/// Written so that what is no number is not.
bool SafetyChain::is_well_within(const Vec3& wanted) const noexcept {
    return squared_length(wanted) < surely_short_n2_ &&
           squared_length(wanted - sent_) < surely_slow_n2_;
}

/// The last word: what does not hold all that is promised is not sent.
Vec3 SafetyChain::confirmed(const Vec3& force, const Vec3& before, std::uint32_t& flags) noexcept {
    if (is_allowed(force, before)) {
        // The limit is a promise: what rounding put beyond it is taken away, too.
        const double length = glm::length(force);
        return sent_ = length > settings_.force_n ? force * (kBelow * settings_.force_n / length)
                                                  : force;
    }
    flags |= kForceNotFinite;
    sent_ = is_allowed(before, before) ? before : Vec3{0.0};
    if (settings_.feedback == ForceFeedback::motors) return after_fault();
    return slewed(Vec3{0.0}, flags);
}

/// Written so that what is no number is not allowed.
bool SafetyChain::is_allowed(const Vec3& force, const Vec3& before) const noexcept {
    const double length = glm::length(force);
    const double change = glm::length(force - before);
    if (!(length <= settings_.force_n * kRounding)) return false;
    // A step that is short beside the force itself is known to the last digits of that.
    const double slack_n = (kRounding - 1.0) * settings_.force_n;
    if (change <= longest_step_n() + slack_n) return true;
    const bool shortens = length + change <= glm::length(before) * kRounding;
    return settings_.feedback == ForceFeedback::motors && shortens &&
           change <= fading_step_n() + slack_n;
}

Vec3 SafetyChain::chosen(const Vec3& wanted, const Vec3& probe, const Vec3& velocity,
                         std::uint32_t& flags) noexcept {
    if (settings_.feedback == ForceFeedback::none) return limited(wanted, flags);
    if (!is_finite(wanted)) {
        flags |= kForceNotFinite;
        return after_fault();
    }
    if (jumped(probe, velocity)) {
        flags |= kProbeJumped;
        return after_fault();
    }
    probe_ = probe;
    placed_ = true;
    if (waits(glm::length(wanted))) {
        flags |= kWaitsForSmallForce;
        return faded();
    }
    const double share = next_share(flags);
    passivity_.observe(probe, velocity, wanted, share);
    if (passivity_.exceeded()) {
        flags |= kEnergyExceeded;
        return after_fault();
    }
    const Vec3 ramped = share * shortened(wanted, flags);
    const Vec3 passive = passivity_.control(ramped, velocity);
    if (passive != ramped) {
        flags |= kEnergyBounded;
        stiffness_share_ *= 1.0 - settings_.period_s / settings_.soften_s;
    }
    const Vec3 force = slewed(shortened(passive, flags), flags);
    passivity_.sent(force);
    return force;
}

/// Everything begins with the wait for a small force.
Vec3 SafetyChain::after_fault() noexcept {
    waiting_ = true;
    calm_s_ = 0.0;
    placed_ = false;
    return faded();
}

/// The longest step of a force on its way to zero, N.
double SafetyChain::fading_step_n() const noexcept {
    return settings_.period_s *
           std::max(settings_.slew_n_per_s, settings_.force_n / settings_.fade_s);
}

Vec3 SafetyChain::faded() noexcept {
    const double step_n = fading_step_n();
    const double length = glm::length(sent_);
    // What rounding leaves of the last step is not a step.
    sent_ = length > step_n * kRounding ? sent_ * (1.0 - step_n / length) : Vec3{0.0};
    return sent_;
}

bool SafetyChain::jumped(const Vec3& probe, const Vec3& velocity) const noexcept {
    // Written so that what overflows, or is no number, is one, too.
    const double farthest_m = settings_.fastest_m_per_s * settings_.period_s;
    const bool near = is_finite(probe) && (!placed_ || glm::distance(probe, probe_) <= farthest_m);
    return !(near && glm::length(velocity) <= settings_.fastest_m_per_s);
}

bool SafetyChain::waits(double wanted_n) noexcept {
    if (!waiting_) return false;
    // What is still on its way to zero after a fault is not to be ramped in from.
    const bool calm = wanted_n <= small_force_n_ && sent_ == Vec3{0.0};
    calm_s_ = calm ? calm_s_ + settings_.period_s : 0.0;
    if (calm_s_ <= settings_.calm_s) return true;
    waiting_ = false;
    ramp_ = 0.0;
    passivity_.restart();
    return false;
}

double SafetyChain::next_share(std::uint32_t& flags) noexcept {
    if (ramp_ < 1.0) {
        ramp_ = std::min(1.0, ramp_ + settings_.period_s / settings_.ramp_s);
        flags |= kRampsIn;
    }
    if (stiffness_share_ < 1.0) {
        stiffness_share_ =
            std::min(1.0, stiffness_share_ + settings_.period_s / settings_.stiffen_s);
        flags |= kSoftened;
    }
    return ramp_ * stiffness_share_;
}

Vec3 SafetyChain::limited(Vec3 wanted, std::uint32_t& flags) noexcept {
    if (!is_finite(wanted)) {
        wanted = Vec3{0.0};
        flags |= kForceNotFinite;
    }
    return slewed(shortened(wanted, flags), flags);
}

Vec3 SafetyChain::shortened(const Vec3& wanted, std::uint32_t& flags) const noexcept {
    const double length = glm::length(wanted);
    if (length <= settings_.force_n) return wanted;
    flags |= kForceClamped;
    // A length that overflows has no direction worth keeping.
    return std::isfinite(length) ? wanted * (settings_.force_n / length) : Vec3{0.0};
}

Vec3 SafetyChain::slewed(const Vec3& wanted, std::uint32_t& flags) noexcept {
    const Vec3 change = wanted - sent_;
    const double change_length = glm::length(change);
    const double longest_change = longest_step_n();
    if (change_length > longest_change) {
        sent_ += change * (longest_change / change_length);
        flags |= kForceSlewed;
    } else {
        sent_ = wanted;
    }
    return sent_;
}

} // namespace palpate
