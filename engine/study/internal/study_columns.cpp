// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/internal/study_columns.h>

#include <array>

namespace palpate::internal {
namespace {

using Value = std::optional<double>;

Value in_contact(const StudyRun& run, double value) {
    return run.frames_in_contact > 0 ? Value(value) : Value();
}

Value of_all(const StudyRun& run, std::size_t frames) {
    return run.frames > 0 ? Value(static_cast<double>(frames)) : Value();
}

Value of_ticks(const StudyRun& run, double value) { return run.has_ticks ? Value(value) : Value(); }

template <class T>
Value known(const std::optional<T>& value) {
    return value ? Value(static_cast<double>(*value)) : Value();
}

Value known(const StudyRun::Error& error, double value) {
    return error.frames > 0 ? Value(value) : Value();
}

constexpr std::array kColumns{
    StudyColumn{"frames_in_contact", "", "frames in contact",
                [](const StudyRun& r) { return Value(r.frames_in_contact); }},
    StudyColumn{"evaluations_mean", "evaluations per frame", "mean",
                [](const StudyRun& r) { return in_contact(r, r.evaluations_mean); }},
    StudyColumn{"evaluations_max", "evaluations per frame", "max",
                [](const StudyRun& r) { return in_contact(r, r.evaluations_max); }},
    StudyColumn{"sub_steps_mean", "sub-steps", "per frame",
                [](const StudyRun& r) { return in_contact(r, r.sub_steps_mean); }},
    StudyColumn{"step_mean_um", "sub-steps", "length, um",
                [](const StudyRun& r) { return in_contact(r, r.step_mean_um); }},
    StudyColumn{"spent_p50_us", "us per frame", "median",
                [](const StudyRun& r) { return in_contact(r, r.spent_p50_us); }},
    StudyColumn{"spent_p99_us", "us per frame", "p99",
                [](const StudyRun& r) { return in_contact(r, r.spent_p99_us); }},
    StudyColumn{"spent_max_us", "us per frame", "max",
                [](const StudyRun& r) { return in_contact(r, r.spent_max_us); }},
    StudyColumn{"level_frames", "distance from the surface, um", "frames",
                [](const StudyRun& r) { return Value(r.level.frames); }},
    StudyColumn{"level_rms_um", "distance from the surface, um", "rms",
                [](const StudyRun& r) { return known(r.level, r.level.rms_um); }},
    StudyColumn{"level_p99_um", "distance from the surface, um", "p99",
                [](const StudyRun& r) { return known(r.level, r.level.p99_um); }},
    StudyColumn{"level_max_um", "distance from the surface, um", "max",
                [](const StudyRun& r) { return known(r.level, r.level.max_um); }},
    StudyColumn{"frames_inside", "inside the surface", "frames",
                [](const StudyRun& r) { return known(r.frames_inside); }},
    StudyColumn{"deepest_um", "inside the surface", "deepest, um",
                [](const StudyRun& r) { return known(r.deepest_um); }},
    StudyColumn{"lost_contact", "against the certified proxy, frames", "lost contact",
                [](const StudyRun& r) { return known(r.lost_contact); }},
    StudyColumn{"elsewhere", "against the certified proxy, frames", "2 mm away",
                [](const StudyRun& r) { return known(r.elsewhere); }},
    StudyColumn{"position_rms_um", "distance from the nearest point, um", "rms",
                [](const StudyRun& r) { return known(r.position, r.position.rms_um); }},
    StudyColumn{"position_p99_um", "distance from the nearest point, um", "p99",
                [](const StudyRun& r) { return known(r.position, r.position.p99_um); }},
    StudyColumn{"position_max_um", "distance from the nearest point, um", "max",
                [](const StudyRun& r) { return known(r.position, r.position.max_um); }},
    StudyColumn{"late_p99_us", "us after the tick", "p99",
                [](const StudyRun& r) { return of_ticks(r, r.late_p99_us); }},
    StudyColumn{"late_max_us", "us after the tick", "max",
                [](const StudyRun& r) { return of_ticks(r, r.late_max_us); }},
    StudyColumn{"over_budget", "frames longer than", "budget",
                [](const StudyRun& r) { return of_all(r, r.over_budget); }},
    StudyColumn{"over_period", "frames longer than", "period",
                [](const StudyRun& r) { return of_all(r, r.over_period); }},
};

Value over_repetitions(const StudyRun& run, double value) {
    return run.repetitions > 1 ? in_contact(run, value) : Value();
}

// Behind the note in study.csv, where scripts that count columns do not meet them.
constexpr std::array kLaterColumns{
    StudyColumn{"repetitions", "", "repetitions",
                [](const StudyRun& r) { return Value(r.repetitions); }},
    StudyColumn{"spent_p50_p10_us", "median us over the repetitions", "p10",
                [](const StudyRun& r) { return over_repetitions(r, r.spent_p50_range_us.p10_us); }},
    StudyColumn{"spent_p50_p90_us", "median us over the repetitions", "p90",
                [](const StudyRun& r) { return over_repetitions(r, r.spent_p50_range_us.p90_us); }},
    StudyColumn{"spent_p99_p10_us", "p99 us over the repetitions", "p10",
                [](const StudyRun& r) { return over_repetitions(r, r.spent_p99_range_us.p10_us); }},
    StudyColumn{"spent_p99_p90_us", "p99 us over the repetitions", "p90",
                [](const StudyRun& r) { return over_repetitions(r, r.spent_p99_range_us.p90_us); }},
    StudyColumn{"spent_mean_us", "us per frame", "mean of 99 %",
                [](const StudyRun& r) { return in_contact(r, r.spent_mean_us); }},
    StudyColumn{"field_samples_mean", "queries per frame", "samples",
                [](const StudyRun& r) { return in_contact(r, r.field_samples_mean); }},
    StudyColumn{"root_queries_mean", "queries per frame", "first roots",
                [](const StudyRun& r) { return in_contact(r, r.root_queries_mean); }},
    StudyColumn{"surface_queries_mean", "queries per frame", "of meshes",
                [](const StudyRun& r) { return in_contact(r, r.surface_queries_mean); }},
    StudyColumn{"converged_frames", "distance from the converged proxy, um", "frames",
                [](const StudyRun& r) { return Value(r.converged.frames); }},
    StudyColumn{"converged_rms_um", "distance from the converged proxy, um", "rms",
                [](const StudyRun& r) { return known(r.converged, r.converged.rms_um); }},
    StudyColumn{"converged_p99_um", "distance from the converged proxy, um", "p99",
                [](const StudyRun& r) { return known(r.converged, r.converged.p99_um); }},
    StudyColumn{"converged_max_um", "distance from the converged proxy, um", "max",
                [](const StudyRun& r) { return known(r.converged, r.converged.max_um); }},
};

} // namespace

std::span<const StudyColumn> study_columns() noexcept { return kColumns; }
std::span<const StudyColumn> later_study_columns() noexcept { return kLaterColumns; }

std::optional<double> setting_of(const StudyRun& run) noexcept {
    if (run.baseline) return {};
    switch (run.loop.method) {
    case SteppingMethod::fixed:
        return run.loop.sub_steps;
    case SteppingMethod::paper:
        return budget_of(run.loop);
    case SteppingMethod::adaptive:
        return run.loop.tolerance_um;
    case SteppingMethod::single:
        break;
    }
    return {};
}

std::vector<const StudyRun*> runs_over_time(const Study& study) {
    std::vector<const StudyRun*> runs;
    for (const StudyRun& run : study.runs)
        if (run.is_the_scenes) runs.push_back(&run);
    return runs;
}

double place_of(const Study& study, const StudyRun& run, std::size_t frame) {
    const double level_m = run.level_m[frame];
    // A cavity's material is outside its sphere, a solid's is within.
    if (study.sphere) return 1e3 * (study.sphere->radius_m + study.sphere->outwards * level_m);
    return 1e6 * level_m;
}

} // namespace palpate::internal
