// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/loop/frame_report.h>
#include <palpate/haptics/stepping/touch.h>

namespace palpate {

/// One row of HapticLoop::touches() in a run.
struct RecordedTouch : Touch {
    std::uint64_t frame = 0; ///< FrameReport::frame

    friend bool operator==(const RecordedTouch&, const RecordedTouch&) = default;
};

/// Frames that were computed, with all that it takes to compute them again: what a trace leaves and
/// a recording keeps.
struct Run {
    DeviceProperties device;               ///< what felt it, as the scene met it
    std::vector<DeviceState> inputs;       ///< what each frame was given, scene frame
    std::vector<FrameReport> frames;       ///< what came out; clock columns included
    std::vector<std::uint32_t> steps_left; ///< N_steps of eq. (8) after each evaluation, frame by
                                           ///< frame; empty where no clock decided
    std::vector<RecordedTouch> touches;    ///< of all frames, in their order
};

} // namespace palpate
