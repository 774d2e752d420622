// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <palpate/engine/devices/device_factory.h>
#include <palpate/engine/loop/run.h>
#include <palpate/engine/run/run_watch.h>
#include <palpate/engine/run/scheduler.h>
#include <palpate/engine/scene/device_placement.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/truth/surface_audit.h>
#include <palpate/haptics/stepping/clock.h>

namespace palpate {

/// How a run at the clock's pace kept it.
struct RealtimeCounts {
    Scheduler scheduler = Scheduler::ordinary; ///< that it had
    bool memory_locked = false;       ///< the system kept the program's memory from being swapped
    std::uint64_t own_work = 0;       ///< overruns: frames that took longer than a frame may
    std::uint64_t woken_late = 0;     ///< overruns: the system let the loop begin too late
    std::uint64_t missed_periods = 0; ///< that passed without a frame
    std::uint64_t silent_loop = 0;    ///< frames with a stale input as the loop had been silent
    std::uint64_t silent_device = 0;  ///< frames with a stale input as the device had been silent
    std::uint64_t dropped = 0; ///< frames that were felt and not recorded: no replay, no audit
};

/// What came out of a trace.
struct Trace : Run {
    std::vector<SurfaceAudit> audits;       ///< one per surface that is felt
    std::optional<RealtimeCounts> realtime; ///< nothing at asap pace
    /// What was felt before the first frame with the flag scene_adopted (RealtimeSettings::next);
    /// null where one scene was felt all the time.
    std::shared_ptr<const Scene> before;
};

/// Computes a device's frames back to back (asap pace), with the device's own time, until it has no
/// more states or `most_frames` have been; each is written to the device and audited outside the
/// clock. The device is started for it, and stopped with a zero force whatever happens.  [setup]
/// Throws DeviceError where it cannot be started, std::runtime_error when cancelled.
Trace run_trace(std::shared_ptr<const Scene> scene, const PlacedDevice& placed, Clock& clock,
                std::uint64_t most_frames, const RunWatch& watch = {});

/// Computes the frames of given inputs, scene frame, back to back, and audits each outside the
/// clock; nobody takes the forces.                                                      [setup]
/// Throws std::runtime_error when cancelled.
Trace run_trace(std::shared_ptr<const Scene> scene, std::span<const DeviceState> inputs,
                Clock& clock, const Progress& progress = {});

/// The same with another method, budget or tolerance than the scene's own; its rate is the inputs'.
/// Inputs that are moved here are not copied. [setup] Throws std::invalid_argument as validate(),
/// std::runtime_error when cancelled.
Trace run_trace(std::shared_ptr<const Scene> scene, const LoopDescription& loop,
                std::vector<DeviceState> inputs, Clock& clock, const Progress& progress = {});

/// The same frames again, bit for bit: the clock decides nothing, and nobody takes the forces.
/// [setup] Throws std::runtime_error when cancelled.
Trace run_again(std::shared_ptr<const Scene> scene, const Run& run, const Progress& progress = {});
/// The same, and tells `watch` of the loop and of each frame.                             [setup]
Trace run_again(std::shared_ptr<const Scene> scene, const Run& run, const RunWatch& watch);

/// Fills in the audits of a run that had no time for them, by computing its frames again; leaves a
/// run without that cannot be computed again: frames are missing, it felt two scenes, or gains or
/// bodies were moved.                                                                    [setup]
/// Throws std::runtime_error when cancelled.
void audit(std::shared_ptr<const Scene> scene, Trace& trace, const Progress& progress = {});

/// Tells `watch` where a device, scene frame, does not hold a scene's coupling.           [setup]
void warn_of_coupling(const Scene& scene, const DeviceProperties& device, const RunWatch& watch);

} // namespace palpate
