// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <palpate/engine/haptic_loop.h>
#include <palpate/engine/internal/frame_truth.h>
#include <palpate/engine/internal/spread.h>

namespace palpate {
namespace {

constexpr double kMicrometres = 1e6;          // um per m
constexpr std::size_t kFramesPerReport = 500; // between two calls of progress

constexpr int kMostShares = 1024; // of method fixed
constexpr std::array kBudgets_us{10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 900.0};
constexpr std::array kTolerances_um{100.0, 10.0, 1.0, 0.1, 0.01, 0.001};

/// One frame's share of a run's averages.
struct Columns {
    std::vector<double> evaluations, spent_us, level_um, position_um;
    double sub_steps = 0.0;
    double way_m = 0.0;
};

double length_of(std::span<const Vec3> path) {
    double way_m = 0.0;
    for (std::size_t i = 1; i < path.size(); ++i)
        way_m += glm::length(path[i] - path[i - 1]);
    return way_m;
}

StudyRun::Error error_of(std::vector<double> distances_um) {
    const internal::Spread spread = internal::spread_of(std::move(distances_um));
    return {spread.count, spread.rms, spread.p99, spread.max};
}

void add_error(const std::optional<internal::FrameError>& error, StudyRun& run, Columns& columns) {
    run.level_m.push_back(error ? error->level_m : std::numeric_limits<double>::quiet_NaN());
    if (!error) return;
    columns.level_um.push_back(kMicrometres * std::abs(error->level_m));
    if (error->position_m) columns.position_um.push_back(kMicrometres * *error->position_m);
}

void conclude(const Columns& columns, StudyRun& run) {
    run.frames_in_contact = columns.spent_us.size();
    const internal::Spread evaluations = internal::spread_of(columns.evaluations);
    const internal::Spread spent_us = internal::spread_of(columns.spent_us);
    run.evaluations_mean = evaluations.mean;
    run.evaluations_max = evaluations.max;
    run.spent_p50_us = spent_us.p50;
    run.spent_p99_us = spent_us.p99;
    run.spent_max_us = spent_us.max;
    if (run.frames_in_contact > 0)
        run.sub_steps_mean = columns.sub_steps / static_cast<double>(run.frames_in_contact);
    if (columns.sub_steps > 0.0)
        run.step_mean_um = kMicrometres * columns.way_m / columns.sub_steps;
    run.level = error_of(columns.level_um);
    run.position = error_of(columns.position_um);
}

/// Tells of each frame; false when it should stop.
using Tick = std::function<bool(std::size_t frame)>;

StudyRun run_once(std::shared_ptr<const Scene> scene, std::span<const DeviceState> inputs,
                  const LoopDescription& settings, Clock& clock, const Tick& tick) {
    StudyRun run;
    run.loop = settings;
    run.level_m.reserve(inputs.size());
    Columns columns;
    HapticLoop loop(scene, clock, settings);
    internal::FrameTruth truth(*scene);
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        const FrameReport frame = loop.frame(inputs[i]);
        add_error(truth.of(frame), run, columns);
        // A frame's budget is for its sub-steps; what is around them is shorter than one.
        if (frame.spent_us > settings.budget_us + frame.estimate_us) ++run.over_budget;
        if (frame.spent_us > 1e6 / settings.rate_hz) ++run.over_period;
        if (frame.contacts > 0) {
            columns.evaluations.push_back(frame.evaluations);
            columns.spent_us.push_back(frame.spent_us);
            columns.sub_steps += frame.sub_steps;
            columns.way_m += length_of(loop.path());
        }
        if (i % kFramesPerReport == 0 && !tick(i)) throw std::runtime_error("cancelled");
    }
    conclude(columns, run);
    return run;
}

bool same_setting(const LoopDescription& a, const LoopDescription& b) {
    if (a.method != b.method) return false;
    switch (a.method) {
    case SteppingMethod::single:
        return true;
    case SteppingMethod::fixed:
        return a.sub_steps == b.sub_steps;
    case SteppingMethod::paper:
        return a.budget_us == b.budget_us;
    case SteppingMethod::adaptive:
        return a.tolerance_um == b.tolerance_um;
    }
    return false;
}

} // namespace

std::vector<LoopDescription> study_settings(const LoopDescription& own) {
    std::vector<LoopDescription> settings;
    const auto with = [&](SteppingMethod method) {
        LoopDescription loop = own;
        loop.method = method;
        return loop;
    };
    settings.push_back(with(SteppingMethod::single));

    const LoopDescription fixed = with(SteppingMethod::fixed);
    settings.push_back(fixed);
    for (int shares = 1; shares <= kMostShares; shares *= 2) {
        settings.push_back(fixed);
        settings.back().sub_steps = shares;
    }
    const LoopDescription paper = with(SteppingMethod::paper);
    settings.push_back(paper);
    for (const double budget_us : kBudgets_us) {
        if (budget_us > 0.9e6 / own.rate_hz * (1.0 + 1e-9)) break;
        settings.push_back(paper);
        settings.back().budget_us = budget_us;
    }
    const LoopDescription adaptive = with(SteppingMethod::adaptive);
    settings.push_back(adaptive);
    for (const double tolerance_um : kTolerances_um) {
        settings.push_back(adaptive);
        settings.back().tolerance_um = tolerance_um;
    }

    // In the order of what they cost; a setting of the range that is the scene's own is there once.
    std::stable_sort(settings.begin(), settings.end(),
                     [](const LoopDescription& a, const LoopDescription& b) {
                         const auto rank = [](const LoopDescription& loop) {
                             switch (loop.method) {
                             case SteppingMethod::single:
                                 return std::pair{0, 0.0};
                             case SteppingMethod::fixed:
                                 return std::pair{1, 1.0 * loop.sub_steps};
                             case SteppingMethod::paper:
                                 return std::pair{2, loop.budget_us};
                             case SteppingMethod::adaptive:
                                 break;
                             }
                             return std::pair{3, -loop.tolerance_um};
                         };
                         return rank(a) < rank(b);
                     });
    settings.erase(std::unique(settings.begin(), settings.end(), same_setting), settings.end());
    return settings;
}

Study run_study(std::shared_ptr<const Scene> scene, std::span<const DeviceState> inputs,
                const std::vector<LoopDescription>& settings, Clock& clock,
                const Progress& progress) {
    Study study;
    study.sphere = internal::FrameTruth(*scene).sphere();
    for (const DeviceState& input : inputs)
        study.time_s.push_back(input.time_s);
    for (const LoopDescription& loop : settings) {
        const auto tick = [&](std::size_t frame) {
            const double runs = static_cast<double>(settings.size());
            const double done = static_cast<double>(study.runs.size()) +
                                static_cast<double>(frame) / static_cast<double>(inputs.size());
            return !progress || progress(done / runs, "studying");
        };
        study.runs.push_back(run_once(scene, inputs, loop, clock, tick));
        LoopDescription own = scene->description().loop;
        own.method = loop.method;
        study.runs.back().is_the_scenes = same_setting(loop, own);
    }
    if (progress) progress(1.0, "studying");
    return study;
}

} // namespace palpate
