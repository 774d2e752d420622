// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/study/cost_budget.h>
#include <palpate/engine/study/error_budget.h>
#include <palpate/engine/study/frame_prices.h>
#include <palpate/engine/study/study_run.h>
#include <palpate/engine/study/sweep.h>
#include <palpate/engine/study/trade_off.h>
#include <palpate/engine/truth/surface_audit.h>
#include <palpate/haptics/stepping/clock.h>

namespace palpate {

/// What run_study() does besides the loop's methods, once.
struct StudyExtent {
    bool baselines = false; ///< those of run_baselines() too, interleaved with the others
    bool converged = false; ///< distances from the converged reference, too
    int repetitions = 1;    ///< times that the path is run with each setting, >= 1
    /// Extracts the mesh of baseline finger_proxy where the scene is a formula without one and
    /// `converged` says where it is touched; or null.
    const SceneResources* resources = nullptr;
    /// A setting whose median frame took longer than this, us, is not run again: it has no spread.
    double most_repeated_us = std::numeric_limits<double>::infinity();
};

/// Accuracy against time: every method over its range.
struct Study {
    std::vector<StudyRun> runs;              ///< in the order of the table
    std::vector<double> time_s;              ///< of each frame
    std::optional<FeltSphere> sphere;        ///< where it is all that is felt
    std::optional<StudyReference> reference; ///< where distances from it were asked for
    std::vector<ErrorPart> errors;           ///< error_budget(), where it was asked for
    std::vector<CostPart> costs;             ///< cost_budget(), the same
    std::vector<FramePrice> prices;          ///< frame_prices(), the same
    std::vector<Sweep> sweeps;               ///< run_sweep(), those that were asked for
};

/// Every method over its range, and the scene's own setting of each: single; fixed with 1, 2, 4 to
/// 1024 sub-steps; paper with budgets of 10 us .. 900 us that leave a tenth of the period; adaptive
/// with tolerances of 100 um .. 0.001 um. [setup]
std::vector<LoopDescription> study_settings(const LoopDescription& own);
/// Those of a scene: of soft layers, has_soft_layers(), method adaptive alone.           [setup]
std::vector<LoopDescription> study_settings(const Scene& scene);

/// Computes the frames with each setting, back to back, and compares each with the truth outside
/// the clock. The settings take turns, a slice of the path each, so that what slows the machine for
/// a while slows all of them.   [setup] Throws std::runtime_error when cancelled.
Study run_study(std::shared_ptr<const Scene> scene, std::span<const DeviceState> inputs,
                const std::vector<LoopDescription>& settings, Clock& clock,
                const Progress& progress = {}, const StudyExtent& extent = {});

/// The same frames by methods up to the paper's own, with queries of a field or a mesh for
/// evaluations: kBaselines over the one level of a volume that the scene lets one feel, whatever
/// its contact, and finger_proxy on its mesh. Measured against that level or, where the surface is
/// a mesh alone, against that. Those for which the scene has no such level or mesh are left out.
/// [setup]
/// Throws std::runtime_error when cancelled.
std::vector<StudyRun> run_baselines(const Scene& scene, std::span<const DeviceState> inputs,
                                    Clock& clock, const Progress& progress = {});

/// Throws std::runtime_error naming the scene's file where no effect of it is on: nothing could be
/// studied.                                                                              [setup]
void check_study(const Scene& scene);

/// The runs as plain text, a line each.                                                 [setup]
std::string study_table(const Study& study);

/// What positions are compared with and what the spread is of, two lines; empty where no reference
/// was asked for.                                                                       [setup]
std::string reference_in_words(const Study& study);

/// The runs as study.csv has them: a header and a line each; every bit of a number, nothing where
/// it is not known. [setup]
std::string study_csv(const Study& study);

/// Writes study.csv, drift.csv, errors.csv, costs.csv, prices.csv, sweeps.csv, front.svg,
/// study.json and index.html into a folder that exists; `command` is what gives them again. Each
/// file is complete or not there. [setup] Throws std::runtime_error naming the file.
void write_study(const std::filesystem::path& folder, const Scene& scene, const Study& study,
                 const std::string& command);

} // namespace palpate
