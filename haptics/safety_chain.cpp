// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/safety_chain.h>

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

PassivitySettings passivity_of(const SafetySettings& settings) noexcept {
    PassivitySettings passivity = settings.passivity;
    passivity.period_s = settings.period_s;
    passivity.force_n = settings.force_n;
    return passivity;
}

} // namespace

SafetyChain::SafetyChain(const SafetySettings& settings) noexcept
    : settings_(settings), passivity_(passivity_of(settings)) {}

Vec3 SafetyChain::send(const Vec3& wanted, const Vec3& probe, const Vec3& velocity,
                       std::uint32_t& flags) noexcept {
    if (settings_.feedback == ForceFeedback::none) return limited(wanted, flags);
    if (!is_finite(wanted)) {
        flags |= kForceNotFinite;
        return fade(flags);
    }
    if (jumped(probe, velocity)) {
        flags |= kProbeJumped;
        return fade(flags);
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
        return fade(flags);
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

Vec3 SafetyChain::fade(std::uint32_t& flags) noexcept {
    if (settings_.feedback == ForceFeedback::none) return limited(Vec3{0.0}, flags);
    waiting_ = true;
    calm_s_ = 0.0;
    placed_ = false;
    return faded();
}

Vec3 SafetyChain::faded() noexcept {
    const double step_n =
        settings_.period_s * std::max(settings_.slew_n_per_s, settings_.force_n / settings_.fade_s);
    const double length = glm::length(sent_);
    constexpr double kRest = 1.0 + 1e-9; // what rounding leaves of the last step is not a step
    sent_ = length > step_n * kRest ? sent_ * (1.0 - step_n / length) : Vec3{0.0};
    return sent_;
}

bool SafetyChain::jumped(const Vec3& probe, const Vec3& velocity) const noexcept {
    // Written so that what overflows, or is no number, is one, too.
    const double farthest_m = settings_.fastest_m_per_s * settings_.period_s;
    const bool near = !placed_ || glm::distance(probe, probe_) <= farthest_m;
    return !(near && glm::length(velocity) <= settings_.fastest_m_per_s);
}

bool SafetyChain::waits(double wanted_n) noexcept {
    if (!waiting_) return false;
    // What is still on its way to zero after a fault is not to be ramped in from.
    const bool calm = wanted_n <= settings_.small_force_n && sent_ == Vec3{0.0};
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
    const double longest_change = settings_.slew_n_per_s * settings_.period_s;
    if (change_length > longest_change) {
        sent_ += change * (longest_change / change_length);
        flags |= kForceSlewed;
    } else {
        sent_ = wanted;
    }
    return sent_;
}

} // namespace palpate
