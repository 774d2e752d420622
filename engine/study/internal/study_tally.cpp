// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/internal/study_tally.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <palpate/engine/report/internal/spread.h>
#include <palpate/haptics/stepping/frame_flags.h>

namespace palpate::internal {
namespace {

constexpr double kMicrometres = 1e6; // um per m
// A budget is for sub-steps; what a frame does around them, counting, coupling, limits, is shorter.
constexpr double kAround_us = 1.0;
constexpr double kHeldBack_m = 0.5e-3; // more than a frame's way, which methods may differ by
constexpr double kLostShare = 0.1;     // of the spring's length
constexpr double kElsewhere_m = 2e-3;  // more than what distance a method keeps, or lags by

} // namespace

StudyRun::Error error_of(std::vector<double> distances_um) {
    const Spread spread = spread_of(std::move(distances_um));
    return {spread.count, spread.rms, spread.p99, spread.max};
}

double trimmed_mean(std::vector<double> times) {
    if (times.empty()) return 0.0;
    std::sort(times.begin(), times.end());
    times.resize(times.size() - times.size() / 100);
    return std::accumulate(times.begin(), times.end(), 0.0) / static_cast<double>(times.size());
}

void StudyTally::add(const FrameReport& frame, std::span<const Vec3> path,
                     const LoopDescription& loop) {
    add_way(frame, path);
    add_frame(frame, loop);
}

void StudyTally::add_way(const FrameReport& frame, std::span<const Vec3> path) noexcept {
    if (frame.contacts == 0) return;
    ++frames_with_way_;
    sub_steps_ += frame.sub_steps;
    for (std::size_t i = 1; i < path.size(); ++i)
        way_m_ += glm::length(path[i] - path[i - 1]);
}

void StudyTally::add_frame(const FrameReport& frame, const LoopDescription& loop) {
    if (frame.spent_us > budget_of(loop) + kAround_us) ++run_.over_budget;
    if (frame.spent_us > 1e6 / loop.rate_hz) ++run_.over_period;
    late_us_.push_back(frame.late_us);
    if (frame.contacts == 0) return;
    evaluations_.push_back(frame.evaluations);
    field_samples_ += frame.field_samples;
    root_queries_ += frame.root_queries;
    surface_queries_ += frame.surface_queries;
    spent_us_.push_back(frame.spent_us);
}

void StudyTally::add_truth(const FrameFinding& finding) {
    const std::optional<FrameError>& error = finding.error;
    run_.level_m.push_back(error ? error->level_m : std::numeric_limits<double>::quiet_NaN());
    if (finding.depth_m) {
        run_.frames_inside = run_.frames_inside.value_or(0) + (*finding.depth_m > 0.0 ? 1 : 0);
        run_.deepest_um = std::max(run_.deepest_um.value_or(0.0), kMicrometres * *finding.depth_m);
    }
    if (!error) return;
    level_um_.push_back(kMicrometres * std::abs(error->level_m));
    if (error->position_m) position_um_.push_back(kMicrometres * *error->position_m);
}

void StudyTally::add_certified(const FrameReport& frame, const Vec3& certified) {
    const double held_back_m = glm::length(frame.probe - certified);
    const double held_here_m = glm::length(frame.probe - place_on_surface(frame));
    const bool is_lost = held_back_m > kHeldBack_m && held_here_m < kLostShare * held_back_m;
    const bool is_elsewhere = glm::length(place_on_surface(frame) - certified) > kElsewhere_m;
    const bool counts = is_computed(frame.flags); // of a silent device nothing is where it says
    run_.lost_contact = run_.lost_contact.value_or(0) + (counts && is_lost ? 1 : 0);
    run_.elsewhere = run_.elsewhere.value_or(0) + (counts && is_elsewhere ? 1 : 0);
}

void StudyTally::add_converged(const FrameReport& frame, const Vec3& proxy, bool in_contact) {
    if (!in_contact && frame.contacts == 0) return;
    converged_um_.push_back(kMicrometres * glm::length(place_on_surface(frame) - proxy));
}

StudyRun StudyTally::conclude(const LoopDescription& loop) && {
    run_.loop = loop;
    run_.frames_in_contact = spent_us_.size();
    if (!spent_us_.empty()) {
        const double frames = static_cast<double>(spent_us_.size());
        run_.field_samples_mean = field_samples_ / frames;
        run_.root_queries_mean = root_queries_ / frames;
        run_.surface_queries_mean = surface_queries_ / frames;
    }
    run_.spent_mean_us = trimmed_mean(spent_us_);
    const Spread evaluations = spread_of(std::move(evaluations_));
    const Spread spent_us = spread_of(std::move(spent_us_));
    run_.frames = late_us_.size();
    const Spread late_us = spread_of(std::move(late_us_));
    run_.evaluations_mean = evaluations.mean;
    run_.evaluations_max = evaluations.max;
    run_.spent_p50_us = spent_us.p50;
    run_.spent_p99_us = spent_us.p99;
    run_.spent_max_us = spent_us.max;
    run_.late_p99_us = late_us.p99;
    run_.late_max_us = late_us.max;
    if (frames_with_way_ > 0.0) run_.sub_steps_mean = sub_steps_ / frames_with_way_;
    if (sub_steps_ > 0.0) run_.step_mean_um = kMicrometres * way_m_ / sub_steps_;
    run_.level = error_of(std::move(level_um_));
    run_.position = error_of(std::move(position_um_));
    run_.converged = error_of(std::move(converged_um_));
    return std::move(run_);
}

} // namespace palpate::internal
