// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include <palpate/geometry/isosurface.h>

namespace palpate::internal {

/// Thrown out of the middle of CGAL when progress wishes to cancel.
struct Cancelled {};

/// Tells progress how far an extraction is, out of the work that CGAL is seen to ask for: values of
/// the field, questions about the complex.
class ExtractionProgress {
public:
    explicit ExtractionProgress(const Progress& progress) : progress_(progress) {}

    /// A phase begins that will bring the fraction from where it is to `end` in about
    /// `expected_work` units; reports it. What goes beyond makes the fraction creep.
    /// Throws Cancelled.
    void begin(const std::string& phase, double end, double expected_work);

    /// A unit of work was done; every 0.2 s this is reported. Throws Cancelled.
    void work() {
        if (++done_ % kClockEvery == 0) look_at_clock();
    }
    double done() const { return static_cast<double>(done_); } ///< units of work in the phase

private:
    static constexpr std::uint64_t kClockEvery = 1024; // units between looks at the clock

    void look_at_clock();
    void report(double fraction);

    const Progress& progress_;
    std::string phase_;
    double begin_ = 0.0, end_ = 0.0; // of the phase
    double expected_ = 1.0;
    std::uint64_t done_ = 0; // in the phase
    double reported_ = 0.0;
    std::chrono::steady_clock::time_point reported_at_{};
};

} // namespace palpate::internal
