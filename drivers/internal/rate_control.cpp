// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include <palpate/drivers/internal/rate_control.h>

namespace palpate::internal {
namespace {

constexpr double kLongestStep = 0.05;   // s
constexpr double kLongestWait = 3600.0; // s
constexpr double kNoTurn = 1e-12;       // rad; below this an axis of rotation is noise

void check(bool right, const char* what, double value) {
    if (!right)
        throw std::invalid_argument(std::string("space mouse: ") + what + ", not " +
                                    std::to_string(value));
}

SpaceMouseSettings checked(const SpaceMouseSettings& settings) {
    check(std::isfinite(settings.speed_m_per_s) && settings.speed_m_per_s > 0.0,
          "speed_m_per_s must be above 0", settings.speed_m_per_s);
    check(std::isfinite(settings.turn_rad_per_s) && settings.turn_rad_per_s >= 0.0,
          "turn_rad_per_s must be at least 0", settings.turn_rad_per_s);
    check(settings.dead_zone >= 0.0 && settings.dead_zone < 1.0,
          "dead_zone must be from 0 to below 1", settings.dead_zone);
    check(std::isfinite(settings.silence_s) && settings.silence_s > 0.0,
          "silence_s must be above 0", settings.silence_s);
    check(settings.reconnect_s > 0.0 && settings.reconnect_s <= kLongestWait,
          "reconnect_s must be above 0 and at most 3600", settings.reconnect_s);
    const Box& box = settings.workspace_m;
    check(is_finite(box.lower) && is_finite(box.upper) && !box.empty(),
          "workspace_m must be a box; its first side is", box.lower.x);
    return settings;
}

/// 0 within the dead zone, from there on without a step up to 1.
double beyond(double deflection, double dead_zone) {
    const double beyond_zone = (std::abs(deflection) - dead_zone) / (1.0 - dead_zone);
    return std::copysign(std::clamp(beyond_zone, 0.0, 1.0), deflection);
}

} // namespace

RateControlledProbe::RateControlledProbe(const SpaceMouseSettings& settings)
    : settings_(checked(settings)), position_(settings.workspace_m.center()) {}

// A dead zone for each axis: it also takes away what a push along one axis says about the others.
Vec3 RateControlledProbe::rate(const Vec3& deflection) const noexcept {
    const Vec3 each(beyond(deflection.x, settings_.dead_zone),
                    beyond(deflection.y, settings_.dead_zone),
                    beyond(deflection.z, settings_.dead_zone));
    const double length = glm::length(each);
    return length > 1.0 ? each / length : each;
}

void RateControlledProbe::advance(const SpaceMouseDeflection& deflection, double seconds) noexcept {
    velocity_ = Vec3(0.0);
    if (!(seconds > 0.0)) return;
    const double step = std::min(seconds, kLongestStep);
    const Vec3 wanted = position_ + settings_.speed_m_per_s * step * rate(deflection.push);
    const Vec3 reached =
        glm::clamp(wanted, settings_.workspace_m.lower, settings_.workspace_m.upper);
    velocity_ = (reached - position_) / step;
    position_ = reached;

    const Vec3 turn = settings_.turn_rad_per_s * step * rate(deflection.turn);
    const double angle = glm::length(turn);
    if (angle < kNoTurn) return;
    orientation_ = glm::normalize(glm::angleAxis(angle, turn / angle) * orientation_);
}

bool RateControlledProbe::moved_by(const SpaceMouseDeflection& deflection) const noexcept {
    return rate(deflection.push) != Vec3(0.0) ||
           (settings_.turn_rad_per_s > 0.0 && rate(deflection.turn) != Vec3(0.0));
}

} // namespace palpate::internal
