// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/hand/passivity_control.h>

#include <algorithm>
#include <cmath>

#include <palpate/geometry/range.h>

namespace palpate {
namespace {

// The account is not spent in one frame: a force that fades is felt less than one that breaks off.
// Of longer frames one spends all of it at most.
constexpr double kSpread_s = 5e-3;

} // namespace

PassivityControl::PassivityControl(const PassivitySettings& settings) : settings_(settings) {
    require("passivity: period_s", settings.period_s, kPositive);
    require("passivity: force_n", settings.force_n, kPositive);
    require("passivity: stiffness_n_per_m", settings.stiffness_n_per_m, kPositive);
    require("passivity: damping_n_s_per_m", settings.damping_n_s_per_m, kNotNegative);
    require("passivity: delay_s", settings.delay_s, kNotNegative);
    require("passivity: bank_j", settings.bank_j, kPositive);
    require("passivity: reserve_j", settings.reserve_j, kPositive);
    require("passivity: active_w", settings.active_w, kNotNegative);
    constexpr double kMostFrames = static_cast<double>(kHistory) - 2.0;
    const double frames = std::min(settings.delay_s / settings.period_s, kMostFrames);
    delay_frames_ = static_cast<std::size_t>(frames);
    delay_rest_ = frames - static_cast<double>(delay_frames_);
    restart();
}

void PassivityControl::restart() noexcept {
    account_j_ = settings_.bank_j;
    placed_ = false;
    sent_.fill(Vec3{0.0});
    spring_.fill(0.0);
}

void PassivityControl::observe(const Vec3& position, const Vec3& velocity, const Vec3& wanted,
                               double share) noexcept {
    if (placed_) {
        // At work between the two positions: one force, and the one before it for a share of it.
        const Vec3 at_work = (1.0 - delay_rest_) * sent_before(delay_frames_) +
                             delay_rest_ * sent_before(delay_frames_ + 1);
        account_j_ -= glm::dot(at_work, position - position_);
        account_j_ += settings_.period_s *
                      (settings_.damping_n_s_per_m * squared_length(velocity) + settings_.active_w);
    }
    placed_ = true;
    position_ = position;
    spring_[(frame_ + 1) % kHistory] = share * spring_energy(wanted);
    account_j_ = std::min(account_j_, settings_.bank_j + highest_spring_energy());
}

double PassivityControl::spring_energy(const Vec3& wanted) const noexcept {
    // Beyond the limit F the force is constant.
    const double f = glm::length(wanted);
    const double kept = std::min(f, settings_.force_n);
    return kept * (f - 0.5 * kept) / settings_.stiffness_n_per_m;
}

double PassivityControl::highest_spring_energy() const noexcept {
    // What is at work now belongs to the spring of the delay ago.
    double highest = 0.0;
    for (std::size_t back = 0; back <= delay_frames_ + 1; ++back)
        highest = std::max(highest, spring_[(frame_ + 1 + kHistory - back) % kHistory]);
    return highest;
}

double PassivityControl::work_under_way(const Vec3& velocity) const noexcept {
    Vec3 impulse = delay_rest_ * sent_before(delay_frames_);
    for (std::size_t frames = 0; frames < delay_frames_; ++frames)
        impulse += sent_before(frames);
    return std::max(0.0, settings_.period_s * glm::dot(impulse, velocity));
}

Vec3 PassivityControl::control(const Vec3& force, const Vec3& velocity) const noexcept {
    const double squared_speed = squared_length(velocity);
    const double power = glm::dot(force, velocity); // W, on the hand
    const double spread_s = std::max(kSpread_s, settings_.period_s);
    const double allowed = std::max((account_j_ - work_under_way(velocity)) / spread_s,
                                    -settings_.damping_n_s_per_m * squared_speed);
    if (!(power > allowed)) return force;
    // power > allowed >= -b v^2 needs a movement, unless both are rounding.
    constexpr double kRest = 1e-12; // m^2/s^2: 1 um/s
    if (squared_speed < kRest) return force;
    return force - velocity * ((power - allowed) / squared_speed);
}

void PassivityControl::sent(const Vec3& force) noexcept {
    frame_ = (frame_ + 1) % kHistory;
    sent_[frame_] = force;
}

} // namespace palpate
