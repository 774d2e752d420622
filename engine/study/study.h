// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/study/baselines.h>
#include <palpate/engine/truth/surface_audit.h>
#include <palpate/haptics/stepping/clock.h>

namespace palpate {

/// What one method with one setting made of a scene's path. Evaluations, sub-steps, steps and
/// microseconds are of the frames in contact; free flight would only dilute them.
struct StudyRun {
    std::optional<BaselineKind> baseline; ///< instead of the loop's methods
    LoopDescription loop;                 ///< method and setting
    std::string pace; ///< "1000 Hz SCHED_FIFO"; empty: back to back, with the path's own time
    bool is_the_scenes = true;         ///< the setting is the scene's own, not one of the range
    std::size_t frames_in_contact = 0; ///< what the means and shares below are of
    double evaluations_mean = 0.0;     ///< per frame
    double evaluations_max = 0.0;      ///< in one frame
    double sub_steps_mean = 0.0;       ///< per frame
    double step_mean_um = 0.0;         ///< length of the proxy's sub-steps
    double spent_p50_us = 0.0;         ///< time of a frame, median
    double spent_p99_us = 0.0;         ///< the same, 99th percentile
    double spent_max_us = 0.0;         ///< the same, longest
    double spent_mean_us = 0.0;      ///< the same, mean without the slowest hundredth of the frames
    double field_samples_mean = 0.0; ///< values or gradients read, per frame
    double root_queries_mean = 0.0;  ///< exact first roots, per frame
    double surface_queries_mean = 0.0; ///< rays and closest points of meshes, per frame
    double late_p99_us = 0.0;          ///< start of a frame after its tick, of all; 0 back to back
    double late_max_us = 0.0;          ///< the same, largest
    std::size_t over_budget = 0;       ///< frames, of all, longer than the budget by more than 1 us
    std::size_t over_period = 0;       ///< frames, of all, longer than the frame's period

    /// rms, 99th percentile and maximum of a distance over the frames that have one, um.
    struct Error {
        std::size_t frames = 0; ///< 0: not known
        double rms_um = 0.0;    ///< root of the mean square
        double p99_um = 0.0;    ///< 99 of 100 frames do not exceed it
        double max_um = 0.0;    ///< of the worst frame
    };
    Error level;     ///< from the surface
    Error position;  ///< from the surface's point nearest to the probe; spheres only
    Error converged; ///< from the proxy of the converged reference, in frames in which either is
                     ///< in contact

    /// The tenth and the ninetieth percentile of a number over the repetitions, us.
    struct Range {
        double p10_us = 0.0; ///< one repetition in ten is below
        double p90_us = 0.0; ///< nine in ten are not above
    };
    std::size_t repetitions = 1; ///< how often the path was run. Errors and counts are of the first
                                 ///< one; spent_p50_us, spent_p99_us and spent_mean_us are medians
                                 ///< over all, spent_max_us the longest of all
    Range spent_p50_range_us;    ///< of the median; only with two repetitions or more
    Range spent_p99_range_us;    ///< of the 99th percentile; the same

    // Of all frames; nothing where no level of a field is felt.
    std::optional<std::size_t>
        frames_inside;                ///< that ended deeper than the certificate's tolerance
    std::optional<double> deepest_um; ///< at the end of a frame; 0: never inside
    // Against a proxy that no chord takes through the surface; nothing at the clock's pace and
    // where levels are not all that is felt, or yield.
    std::optional<std::size_t> lost_contact; ///< frames with less than a tenth of that proxy's
                                             ///< force, where it is held back by over 0.5 mm
    std::optional<std::size_t> elsewhere;    ///< frames that end over 2 mm from that proxy

    std::string note; ///< why the run does not show what its method is for, without a comma; empty
                      ///< as a rule

    std::vector<double> level_m; ///< per frame, signed, > 0 inside; NaN where not known
};

/// What the errors of a study are compared with beside the level.
struct StudyReference {
    std::string method;        ///< in words: "adaptive to 1e-06 um, 256 evaluations"
    StudyRun::Error own_error; ///< between it and a coarser one: what it is known to
};

/// What run_study() does besides the loop's methods, once.
struct StudyExtent {
    bool baselines = false; ///< those of run_baselines() too, interleaved with the others
    bool converged = false; ///< distances from the converged reference, too
    int repetitions = 1;    ///< times that the path is run with each setting, >= 1
};

/// Accuracy against time: every method over its range.
struct Study {
    std::vector<StudyRun> runs;              ///< in the order of the table
    std::vector<double> time_s;              ///< of each frame
    std::optional<FeltSphere> sphere;        ///< where it is all that is felt
    std::optional<StudyReference> reference; ///< where distances from it were asked for
};

/// Every method over its range, and the scene's own setting of each: single; fixed with 1, 2, 4 to
/// 1024 sub-steps; paper with budgets of 10 us .. 900 us that leave a tenth of the period; adaptive
/// with tolerances of 100 um .. 0.001 um. [setup]
std::vector<LoopDescription> study_settings(const LoopDescription& own);

/// Computes the frames with each setting, back to back, and compares each with the truth outside
/// the clock. The settings take turns, a slice of the path each, so that what slows the machine for
/// a while slows all of them.   [setup] Throws std::runtime_error when cancelled.
Study run_study(std::shared_ptr<const Scene> scene, std::span<const DeviceState> inputs,
                const std::vector<LoopDescription>& settings, Clock& clock,
                const Progress& progress = {}, const StudyExtent& extent = {});

/// The same frames by methods up to the paper's own, with field queries for evaluations, over the
/// one level of a volume that the scene lets one feel, whatever its contact, and measured against
/// that level; none where there is no level or several.                                  [setup]
/// Throws std::runtime_error when cancelled.
std::vector<StudyRun> run_baselines(const Scene& scene, std::span<const DeviceState> inputs,
                                    Clock& clock, const Progress& progress = {});

/// Throws std::runtime_error naming the scene's file where no effect of it is on: nothing could be
/// studied.                                                                              [setup]
void check_study(const Scene& scene);

/// The method of a run alone: "fixed", "penalty".                                         [any]
std::string_view method_of(const StudyRun& run) noexcept;

/// A run as tables name it: "fixed 46", "adaptive 0.1 um", "single, 1000 Hz SCHED_FIFO". [any]
std::string title(const StudyRun& run);

/// The same, with a word where its note says that it does not show what its method is for. [any]
std::string title_with_mark(const StudyRun& run);

/// The runs as plain text, a line each.                                                 [setup]
std::string study_table(const Study& study);

/// What positions are compared with and what the spread is of, two lines; empty where no reference
/// was asked for.                                                                       [setup]
std::string reference_in_words(const Study& study);

/// The runs as study.csv has them: a header and a line each; every bit of a number, nothing where
/// it is not known. [setup]
std::string study_csv(const Study& study);

/// Writes study.csv, drift.csv, study.json and index.html into a folder that exists; `command`
/// is what gives them again. Each file is complete or not there. [setup] Throws std::runtime_error
/// naming the file.
void write_study(const std::filesystem::path& folder, const Scene& scene, const Study& study,
                 const std::string& command);

} // namespace palpate
