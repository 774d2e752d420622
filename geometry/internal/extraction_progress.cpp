// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/internal/extraction_progress.h>

#include <algorithm>
#include <cmath>

namespace palpate::internal {
namespace {

constexpr double kPeriod = 0.2; // s between reports

/// Share of a phase after a share of its expected work: the same up to 0.8, then ever slower.
double share_after(double work) {
    constexpr double kSure = 0.8;
    if (work <= kSure) return work;
    return 1.0 - (1.0 - kSure) * std::exp(-(work - kSure) / (1.0 - kSure));
}

} // namespace

void ExtractionProgress::begin(const std::string& phase, double end, double expected_work) {
    phase_ = phase;
    begin_ = reported_;
    end_ = std::max(end, begin_);
    expected_ = std::max(expected_work, 1.0);
    done_ = 0;
    report(begin_);
}

void ExtractionProgress::look_at_clock() {
    const std::chrono::duration<double> since = std::chrono::steady_clock::now() - reported_at_;
    if (since.count() < kPeriod) return;
    report(begin_ + (end_ - begin_) * share_after(static_cast<double>(done_) / expected_));
}

void ExtractionProgress::report(double fraction) {
    reported_ = std::max(reported_, fraction);
    reported_at_ = std::chrono::steady_clock::now();
    if (progress_ && !progress_(reported_, phase_)) throw Cancelled{};
}

} // namespace palpate::internal
