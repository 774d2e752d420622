// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <future>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <palpate/engine/run/run_watch.h>
#include <palpate/engine/run/scheduler.h>
#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene.h>

namespace palpate {

/// How a run at the clock's pace is scheduled, and when it ends.
struct RealtimeSettings {
    /// Of a period, what a frame's budget may take; the rest is the device's and the system's.
    static constexpr double kMostDuty = 0.9;

    Scheduler scheduler = Scheduler::fifo; ///< wanted for the loop
    std::optional<int> cpu;                ///< processor that the loop stays on, from 0; empty: any
    std::uint64_t most_frames = std::numeric_limits<std::uint64_t>::max(); ///< then the run ends
    double longest_s = std::numeric_limits<double>::infinity(); ///< of the clock, s: then it ends

    /// Which frames the result has: none of a run without an end, which would fill the memory.
    enum class Keep : std::uint8_t { all, none };
    Keep keep = Keep::all; ///< RunWatch::frame is told of every frame either way

    /// Another scene with the same surfaces, which the loop adopts (HapticLoop::adopt()) as soon as
    /// it is ready, if each contact goes on from what it was, as `guarded` does from `volume`. Else
    /// once no surface has been felt for kFree_s: a new contact with a surface that holds the proxy
    /// might find it inside. Empty: there is none. If making it throws, or it is null, or its
    /// surfaces are others, `watch.warning` says so, and the run goes on as it began. A deferred
    /// one, which nobody would make, throws std::invalid_argument.
    std::shared_future<std::shared_ptr<const Scene>> next;
    static constexpr double kFree_s = 0.05; ///< of frames without contact, s
};

/// Throws std::invalid_argument where a scene's budget leaves less than a tenth of its period.
/// [setup]
void check_duty(const LoopDescription& loop);

/// Runs a scene over a device at its rate, in a thread of its own that ends with the call: absolute
/// deadlines on CLOCK_MONOTONIC (FrameSchedule), scheduler and locked memory as far as the system
/// permits (else `watch.warning` says what is missing), everything allocated before the first
/// frame. The calling thread records what comes through a ring, and tells `watch`. The run ends
/// with the device's states, at a limit, or when `watch.progress` says so; then the force of a
/// device that takes one is led to zero, within 50 ms, and what was recorded is the result.
/// Whatever is thrown meanwhile, the device gets a zero force and is stopped.            [setup]
/// Nothing is audited in real time: see audit(). Throws DeviceError where the device
/// cannot be started, std::invalid_argument as check_duty(), and of fewer than 60 frames a second
/// with motors.
Trace run_realtime(std::shared_ptr<const Scene> scene, const PlacedDevice& placed,
                   const RealtimeSettings& settings, const RunWatch& watch = {});

/// One of several hands in a scene: what its loop has of its own.
struct RealtimeHand {
    std::shared_ptr<const Scene> scene; ///< as this hand has it: Scene::of_hand() of one scene
    PlacedDevice placed;                ///< nobody else's
    RealtimeSettings settings;          ///< a limit ends this hand alone
    RunWatch watch;                     ///< told in the calling thread, of this hand alone
};

/// Runs several hands at once, each as run_realtime() does alone: loop, thread, deadlines, safety
/// chain and recording are its own, and only the scene is shared. Tools do not feel each other. All
/// devices are started before the first loop. A hand whose device has no more states, or that comes
/// to a limit, ends alone; when the `progress` of any watch says so, all end. The result has a
/// trace for each, in the same order.                                                    [setup]
/// Throws as run_realtime(), before the first frame; all devices are stopped then.
std::vector<Trace> run_realtime(std::span<const RealtimeHand> hands);

} // namespace palpate
