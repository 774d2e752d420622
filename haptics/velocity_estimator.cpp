// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/velocity_estimator.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {
namespace {

// Two positions that are a step apart may be a little more in floating point.
constexpr double kSlack = 1e-6; // of a step

} // namespace

const Vec3& VelocityEstimator::update(double time_s, const Vec3& position) noexcept {
    if (!std::isfinite(time_s) || !is_finite(position)) return without_news();
    if (count_ > 0 && !(time_s > newest(0).time_s)) return without_news();
    repeats_ = 0;
    samples_[next_] = {time_s, position};
    next_ = (next_ + 1) % kCapacity;
    count_ = std::min(count_ + 1, kCapacity);
    const Vec3 velocity{along(0), along(1), along(2)};
    // Positions at the end of the number range, or times next to each other, may overflow.
    velocity_ = is_finite(velocity) ? velocity : Vec3{0.0};
    return velocity_;
}

const Vec3& VelocityEstimator::without_news() noexcept {
    if (repeats_ < kMostRepeats)
        ++repeats_;
    else
        velocity_ = Vec3{0.0};
    return velocity_;
}

void VelocityEstimator::restart() noexcept {
    repeats_ = 0;
    next_ = 0;
    count_ = 0;
    velocity_ = Vec3{0.0};
}

double VelocityEstimator::along(int axis) const noexcept {
    // Slopes of the lines through the newest sample that explain all samples so far.
    double lowest = -std::numeric_limits<double>::infinity();
    double highest = std::numeric_limits<double>::infinity();
    double slope = 0.0; // of the line to the window's oldest sample
    const double step = settings_.step_m * (1.0 + kSlack);
    bool moved = false;
    for (std::size_t back = 1; back < count_; ++back) {
        const double age_s = newest(0).time_s - newest(back).time_s; // > 0: times increase
        if (age_s > settings_.longest_s) break;
        const double rise = newest(0).position[axis] - newest(back).position[axis];
        const double low = std::max(lowest, (rise - step) / age_s);
        const double high = std::min(highest, (rise + step) / age_s);
        if (low > high) break;
        lowest = low;
        highest = high;
        slope = rise / age_s;
        moved = true;
    }
    if (!moved || (lowest <= 0.0 && highest >= 0.0)) return 0.0; // rest explains it
    return std::clamp(slope, lowest, highest);
}

} // namespace palpate
