// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/hand/velocity_estimator.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace palpate {
namespace {

// Two positions that are a step apart may be a little more in floating point.
constexpr double kSlack = 1e-6; // of a step

/// Of one axis: the slopes of the lines through the newest sample that explain all samples so far.
struct Door {
    double lowest = -std::numeric_limits<double>::infinity();
    double highest = std::numeric_limits<double>::infinity();
    double slope = 0.0; // of the line to the window's oldest sample
    bool open = true;   // the window may grow
    bool moved = false; // it has a sample beside the newest

    /// The next older sample: the newest is `rise` m above it; 1 / age, 1/s.
    void take(double rise, double per_s, double step_m) noexcept {
        const double low = std::max(lowest, (rise - step_m) * per_s);
        const double high = std::min(highest, (rise + step_m) * per_s);
        open = open && low <= high;
        if (!open) return;
        lowest = low;
        highest = high;
        slope = rise * per_s;
        moved = true;
    }
    double velocity() const noexcept {
        if (!moved || (lowest <= 0.0 && highest >= 0.0)) return 0.0; // rest explains it
        return std::clamp(slope, lowest, highest);
    }
};

} // namespace

const Vec3& VelocityEstimator::update(double time_s, const Vec3& position) noexcept {
    if (!is_finite(position)) return without_news();
    time_s = time_of(time_s, position);
    if (!std::isfinite(time_s)) return without_news();
    if (count_ > 0 && !(time_s > newest(0).time_s)) {
        older_ = time_s < newest(0).time_s ? older_ + 1 : 0;
        if (older_ <= kMostRepeats) return without_news();
        restart();
    }
    repeats_ = older_ = 0;
    samples_[next_] = {time_s, position};
    next_ = (next_ + 1) % kCapacity;
    count_ = std::min(count_ + 1, kCapacity);
    const Vec3 velocity = of_windows();
    // Positions at the end of the number range, or times next to each other, may overflow.
    velocity_ = is_finite(velocity) ? velocity : Vec3{0.0};
    return velocity_;
}

/// The device's own time, or a period after the last sample where its clock stands. One that is no
/// number stands too. Samples of two clocks do not go together: where one takes the other's place,
/// all begins anew.
double VelocityEstimator::time_of(double time_s, const Vec3& position) noexcept {
    if (std::isfinite(time_s) && time_s != clock_s_) {
        if (clock_stands()) restart();
        clock_s_ = time_s;
        stands_s_ = 0.0;
    } else if (position != seen_ && !clock_stands()) {
        stands_s_ += settings_.period_s;
        if (clock_stands()) restart();
    }
    seen_ = position;
    if (!clock_stands()) return time_s;
    if (count_ > 0) return newest(0).time_s + settings_.period_s;
    return std::isfinite(time_s) ? time_s : 0.0;
}

const Vec3& VelocityEstimator::without_news() noexcept {
    if (repeats_ < kMostRepeats)
        ++repeats_;
    else
        velocity_ = Vec3{0.0};
    return velocity_;
}

void VelocityEstimator::restart() noexcept {
    repeats_ = older_ = 0;
    next_ = 0;
    count_ = 0;
    velocity_ = Vec3{0.0};
}

Vec3 VelocityEstimator::of_windows() const noexcept {
    const double step_m = settings_.step_m * (1.0 + kSlack);
    std::array<Door, 3> doors;
    for (std::size_t back = 1; back < count_; ++back) {
        const Sample& older = newest(back);
        const double age_s = newest(0).time_s - older.time_s; // > 0: times increase
        if (age_s > settings_.longest_s) break;
        const double per_s = 1.0 / age_s;
        const Vec3 rise = newest(0).position - older.position;
        for (int axis = 0; axis < 3; ++axis)
            doors[static_cast<std::size_t>(axis)].take(rise[axis], per_s, step_m);
        if (!doors[0].open && !doors[1].open && !doors[2].open) break;
    }
    return {doors[0].velocity(), doors[1].velocity(), doors[2].velocity()};
}

} // namespace palpate
