// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <palpate/engine/scene/scene_description.h>
#include <palpate/engine/study/baselines.h>

namespace palpate {

/// What one method with one setting made of a scene's path. Evaluations, sub-steps, steps and
/// microseconds are of the frames in contact; free flight would only dilute them.
struct StudyRun {
    std::optional<BaselineKind> baseline; ///< instead of the loop's methods
    LoopDescription loop;                 ///< method and setting
    std::string pace;       ///< "1000 Hz SCHED_FIFO"; empty: back to back, with the path's own time
    bool has_ticks = false; ///< frames began at the ticks of a clock
    std::size_t frames = 0; ///< that were run; 0: the scheduler was not permitted
    bool is_the_scenes = true;         ///< the setting is the scene's own, not one of the range
    std::size_t frames_in_contact = 0; ///< what the means and shares below are of
    double evaluations_mean = 0.0;     ///< per frame
    double evaluations_max = 0.0;      ///< in one frame
    double sub_steps_mean = 0.0;       ///< per frame
    double step_mean_um = 0.0;         ///< length of the proxy's sub-steps
    double spent_p50_us = 0.0;         ///< time of a frame, median
    double spent_p99_us = 0.0;         ///< the same, 99th percentile
    double spent_max_us = 0.0;         ///< the same, longest
    double spent_mean_us = 0.0; ///< the same: of each frame the median over the repetitions, and of
                                ///< these the mean without the slowest hundredth
    double field_samples_mean = 0.0;   ///< values or gradients read, per frame
    double root_queries_mean = 0.0;    ///< exact first roots, per frame
    double surface_queries_mean = 0.0; ///< rays and closest points of meshes, per frame
    double late_p99_us = 0.0;          ///< start of a frame after its tick, of all; 0 without ticks
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

    /// The tenth and the ninetieth percentile of a number over the repetitions, us; NaN of one
    /// repetition, which says nothing of a spread.
    struct Range {
        double p10_us = std::numeric_limits<double>::quiet_NaN(); ///< one in ten is below
        double p90_us = std::numeric_limits<double>::quiet_NaN(); ///< nine in ten are not above
    };
    std::size_t repetitions = 1; ///< how often the path was run. Errors and counts are of the first
                                 ///< one; spent_p50_us and spent_p99_us are medians
                                 ///< over all, spent_max_us the longest of all
    std::vector<double> spent_p50_each_us; ///< the median of each repetition, in their order
    Range spent_p50_range_us;              ///< of the median; only with two repetitions or more
    Range spent_p99_range_us;              ///< of the 99th percentile; the same

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
    StudyRun::Error along; ///< what is left of the way to the probe along the surface, where one
                           ///< smooth level alone is felt: 0 at the point that is nearest,
                           ///< whoever found it; frames 0: not known
};

/// The method of a run alone: "fixed", "penalty".                                         [any]
std::string_view method_of(const StudyRun& run) noexcept;

/// A run as tables name it: "fixed 46", "adaptive 0.1 um", "single, 1000 Hz SCHED_FIFO". [any]
std::string title(const StudyRun& run);

/// The same, with a word where its note says that it does not show what its method is for. [any]
std::string title_with_mark(const StudyRun& run);

} // namespace palpate
