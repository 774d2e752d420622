// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/study/study_run.h>

namespace palpate {

/// What one thing costs in the frames of a run: how often it is done, and its price.
struct CostPart {
    std::string run;                ///< title() of the run
    std::string part;               ///< "field samples"; "rest"; "frame", which is all of it
    double count = 0.0;             ///< per frame in contact
    double each_ns = 0.0;           ///< measured alone, along the run's path; of the rest 0
    double frame_us = 0.0;          ///< both multiplied; of the rest what is left; < 0: the parts
                                    ///< alone cost more than within a frame, where they overlap
    double per_evaluation_ns = 0.0; ///< the same per evaluation
    // Instructions outside of the kernel; nothing where they are not counted.
    std::optional<double> each_instructions = {};           ///< as each_ns
    std::optional<double> frame_instructions = {};          ///< as frame_us
    std::optional<double> per_evaluation_instructions = {}; ///< as per_evaluation_ns
    std::string no_instructions = {}; ///< why they are not counted, without a comma; empty where
                                      ///< they are
};

/// Where the time of a frame goes, of each of the runs that is the scene's own setting of its
/// method: counters of its frames, times prices measured beside them, in time and, where the kernel
/// counts them, in instructions. No clock is read within a frame. The frame is `spent_mean_us`; a
/// price is the median over the places that the proxy comes along. The parts:
///   field samples     value, gradient and Hessian, one per evaluation at most
///   field values      the samples beyond these
///   first roots       of the certificate's level, along the proxy's way from corner to corner
///   mesh queries      first hits along the same way
///   solver            of one plane
///   clock             readings, counted by a clock that counts
///   empty frame       of a scene in which nothing is felt, without its clock
///   empty sub-steps   of such a scene, beyond the first
///   rest              what is left: step control, certificates, what one query makes another wait
/// Empty where nothing was touched.                                                       [setup]
std::vector<CostPart> cost_budget(std::shared_ptr<const Scene> scene,
                                  std::span<const DeviceState> inputs,
                                  std::span<const StudyRun> runs);

/// The budgets as plain text.                                                             [setup]
std::string cost_budget_table(std::span<const CostPart> parts);

/// The budgets as costs.csv has them: a header and a line each.                           [setup]
std::string cost_budget_csv(std::span<const CostPart> parts);

} // namespace palpate
