// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/effects/contact_vibration.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <palpate/geometry/range.h>

namespace palpate {

namespace {

constexpr double kMost_n = 1e100; // beyond any limit; its square is finite

} // namespace

ContactVibration::ContactVibration(const ContactVibrationSettings& settings) : settings_(settings) {
    require("vibration: amplitude_n_s_per_m", settings.amplitude_n_s_per_m, kNotNegative);
    require("vibration: frequency_hz", settings.frequency_hz, kPositive);
    require("vibration: decay_s", settings.decay_s, kPositive);
    require("vibration: most_n", settings.most_n, kNotNegative);
}

void ContactVibration::restart(const Vec3&) noexcept {
    now_.first = true;
    now_.felt = 0;
    now_.sine_n = now_.cosine_n = Vec3{0.0};
}

void ContactVibration::begin(const FrameContext& frame) noexcept {
    if (frame.after_silence) restart(frame.start);
    // A way from nowhere has no speed: what is felt in a first frame was not struck in it.
    velocity_ = now_.first ? Vec3{0.0} : (frame.probe - now_.probe) / frame.period_s; // > 0
    now_.first = false;
    now_.probe = frame.probe;
    if (frame.period_s != period_s_) tune(frame.period_s);
}

void ContactVibration::tune(double period_s) noexcept {
    period_s_ = period_s;
    const double decay = std::exp(-period_s / settings_.decay_s);
    const double angle = 2.0 * std::numbers::pi * settings_.frequency_hz * period_s;
    turn_sine_ = decay * std::sin(angle);
    turn_cosine_ = decay * std::cos(angle);
}

void ContactVibration::commit(const FrameOutcome& outcome) noexcept {
    const Vec3 sine = turn_cosine_ * now_.sine_n + turn_sine_ * now_.cosine_n;
    now_.cosine_n = turn_cosine_ * now_.cosine_n - turn_sine_ * now_.sine_n;
    now_.sine_n = sine;

    const bool begins = (outcome.felt & ~now_.felt & settings_.surfaces) != 0;
    now_.felt = outcome.felt;
    const Vec3 back = outcome.proxy - now_.probe;
    const double distance = glm::length(back);
    if (!begins || !(distance > 0.0)) return;
    const Vec3 normal = back / distance;
    const double approach = std::max(0.0, -glm::dot(velocity_, normal));
    // No more than what strike() cuts it to anyway, so that no sum overflows.
    strike(std::min(settings_.amplitude_n_s_per_m * approach, kMost_n) * normal);
}

void ContactVibration::strike(const Vec3& impact_n) noexcept {
    now_.cosine_n += impact_n;
    const double amplitude = std::sqrt(squared_length(now_.sine_n) + squared_length(now_.cosine_n));
    if (!(amplitude > settings_.most_n)) return;
    // The sine, which is felt now, is below the limit already: only what is to come is cut.
    const double room = squared_length(now_.sine_n);
    const double cosine = std::sqrt(std::max(0.0, settings_.most_n * settings_.most_n - room));
    const double length = glm::length(now_.cosine_n);
    if (length > 0.0) now_.cosine_n *= cosine / length;
}

} // namespace palpate
