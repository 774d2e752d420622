// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/loop/frame_report.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/study/converged_proxy.h>
#include <palpate/engine/study/study.h>

namespace palpate::internal {

/// What goes along a path frame by frame, from its beginning: a loop, or a baseline.
class Contestant {
public:
    virtual ~Contestant() = default;
    virtual FrameReport frame(const DeviceState& input) noexcept = 0; ///< [loop]
    /// The proxy's corners in the last frame, m.                                         [loop]
    virtual std::span<const Vec3> path() const noexcept = 0;
};

/// One row of a table that is measured: what goes along which path, and what it is compared with.
/// All that it refers to must outlive the run.
struct StudyEntry {
    std::shared_ptr<const Scene> scene;        ///< that is felt
    LoopDescription loop;                      ///< method, setting and rate
    std::optional<BaselineKind> baseline = {}; ///< instead of the loop's method
    std::span<const DeviceState> inputs;       ///< the path
    const Scene* truth = nullptr;         ///< whose levels are the truth; null: the scene itself
    std::span<const Vec3> certified = {}; ///< proxies that no chord takes through; or empty
    const ConvergedProxies* converged = nullptr; ///< the reference for positions; or null
    std::span<const std::uint8_t> timed = {}; ///< 1 for frames whose times count, instead of those
                                              ///< in contact; or empty
    std::shared_ptr<const SurfaceScene> mesh = {}; ///< of baseline finger_proxy alone
};

/// A fresh one of an entry's kind.                                                        [setup]
std::unique_ptr<Contestant> make_contestant(const StudyEntry& entry, Clock& clock);

/// The tenth and ninetieth percentile, of the nearest rank between the smallest and the largest.
/// [any]
StudyRun::Range range_of(std::vector<double> values);

/// The median; of an even number the mean of the two in the middle; 0 of none.             [any]
double median_of(std::vector<double> values);

/// Runs all entries `repetitions` times, in turns: a slice of the path with each of them, then the
/// next slice. Compares the first repetition with the truth, between the slices.          [setup]
/// An entry whose median frame took longer than `most_repeated_us` is not run again.
/// Throws std::runtime_error when cancelled.
std::vector<StudyRun>
run_interleaved(std::span<const StudyEntry> entries, int repetitions, Clock& clock,
                std::string_view doing, const Progress& progress,
                double most_repeated_us = std::numeric_limits<double>::infinity());

} // namespace palpate::internal
