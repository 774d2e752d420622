// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include <palpate/geometry/range.h>

namespace palpate {

/// Estimate of the time a sub-step takes, eq. (10): up by alpha when the last one took longer, down
/// by alpha when not. It follows the 49 % quantile (numerics 4); the bounds keep it alive when
/// steps cost nothing.
class StepTimeEstimator {
public:
    static constexpr double kAlpha = 0.05;     ///< section 5 of the paper
    static constexpr double kLowest_us = 0.05; ///< no gathering and solution is faster

    /// Begins at a fiftieth of the budget (us, > 0), section 4 of the paper, and never exceeds half
    /// of it. Throws std::invalid_argument on another budget. [setup]
    explicit StepTimeEstimator(double budget_us)
        : highest_us_(std::max(0.5 * budget_us, kLowest_us)),
          estimate_us_(std::clamp(budget_us / 50.0, kLowest_us, highest_us_)) {
        require("subdivision: budget_us", budget_us, kPositive);
    }

    double estimate_us() const noexcept { return estimate_us_; } ///< of a step, us, > 0   [loop]

    /// Learns from the duration of a step.                                              [loop]
    void observe(double duration_us) noexcept {
        const double factor = duration_us > estimate_us_ ? 1.0 + kAlpha : 1.0 - kAlpha;
        estimate_us_ = std::clamp(factor * estimate_us_, kLowest_us, highest_us_);
    }

private:
    double highest_us_;
    double estimate_us_;
};

} // namespace palpate
