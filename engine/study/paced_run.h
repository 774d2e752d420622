// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>

#include <palpate/engine/run/scheduler.h>
#include <palpate/engine/study/study.h>

namespace palpate {

/// When the frames of a run at the clock's pace begin.
enum class Pace {
    locked,   ///< at each tick of the scene's rate; a tick that a frame missed is left out
    released, ///< as soon as the one before has ended
};

/// Runs a scene in real time, in a thread of its own that ends with the call: a frame reads the
/// probe where the path has it by then, so that a frame that is late has a longer way to go; a
/// trial begins with the path's row that begins it. [setup] The run's name says pace and scheduler,
/// or that the system did not permit the scheduler: then nothing has run, and frames_in_contact is
/// 0. Evaluations and times are of one frame per period, lengths of sub-steps of all. Sleeps on
/// CLOCK_MONOTONIC. Inputs: at least one frame. Throws std::runtime_error when `progress`, asked
/// ten times a second in the caller's thread, cancels.
StudyRun run_at_pace(std::shared_ptr<const Scene> scene, std::span<const DeviceState> inputs,
                     const LoopDescription& settings, Pace pace, Scheduler scheduler,
                     const Progress& progress = {});

} // namespace palpate
