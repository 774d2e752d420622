// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/loop/frame_report.h>
#include <palpate/engine/run/frame_schedule.h>
#include <palpate/geometry/isosurface.h>

namespace palpate {

/// Why a frame was given a stale state.
enum class Silence : std::uint8_t {
    none,   ///< it was fresh
    device, ///< the device said so
    loop,   ///< the loop itself had been silent for too long
    ending  ///< the run ends, and takes the force to zero first
};

/// A frame as its run saw it.
struct RunFrame {
    DeviceState input;               ///< what the loop was given, scene frame
    FrameReport frame;               ///< what the loop made of it
    std::uint32_t touches = 0;       ///< how many HapticLoop::touches() had
    Silence silence = Silence::none; ///< why `input` was stale, if it was
    std::uint64_t missed = 0;        ///< periods that passed without a frame; 0 at asap pace
    Overrun overrun = Overrun::none; ///< why periods were missed, if any were
};

struct Trace;
class HapticLoop;

/// Who is told of a run while it goes on, in the thread that started it. Each may be empty.
struct RunWatch {
    std::function<void(const std::string&)> warning; ///< before the first frame, each once
    std::function<void(HapticLoop*)> loop; ///< the loop before its first frame, in real time for
                                           ///< what may be called from any thread; and null
                                           ///< before it goes, whatever is thrown meanwhile
    std::function<void(const RunFrame&)> frame; ///< every frame that is recorded, in order
    std::function<void(const Trace&)> kept; ///< in real time, twice a second and at the end: all
                                            ///< that is recorded so far
    Progress progress;                      ///< several times a second; false ends the run
};

} // namespace palpate
