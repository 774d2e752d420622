// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include <palpate/engine/loop/frame_report.h>
#include <palpate/engine/study/study.h>
#include <palpate/engine/truth/frame_truth.h>

namespace palpate::internal {

/// Gathers what a StudyRun says, frame by frame.
class StudyTally {
public:
    /// Counts and times; `path`: the proxy's corners in the frame.                      [setup]
    void add(const FrameReport& frame, std::span<const Vec3> path, const LoopDescription& loop);
    /// The way of a frame that is not worth a row of its own; allocates nothing.         [loop]
    void add_way(const FrameReport& frame, std::span<const Vec3> path) noexcept;
    /// What add() takes in, without the way.                                            [setup]
    void add_frame(const FrameReport& frame, const LoopDescription& loop);
    void add_truth(const FrameFinding& finding); ///< [setup]
    /// Where the proxy would be that no chord takes through the surface, m.             [setup]
    void add_certified(const FrameReport& frame, const Vec3& certified);
    /// Where the converged reference is in the frame, m, if it is in contact there.      [setup]
    void add_converged(const FrameReport& frame, const Vec3& proxy, bool in_contact);

    StudyRun conclude(const LoopDescription& loop) &&; ///< [setup]

private:
    StudyRun run_;
    std::vector<double> evaluations_, spent_us_, late_us_, level_um_, position_um_, converged_um_;
    double frames_with_way_ = 0.0;
    double sub_steps_ = 0.0;
    double way_m_ = 0.0;
    double field_samples_ = 0.0;
    double root_queries_ = 0.0;
    double surface_queries_ = 0.0;
};

/// Distances in um as a study's rows have them.                                           [any]
StudyRun::Error error_of(std::vector<double> distances_um);

/// The mean of times without the slowest hundredth, which are the system's; 0 of none.    [any]
double trimmed_mean(std::vector<double> times);

} // namespace palpate::internal
