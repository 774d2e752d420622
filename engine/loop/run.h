// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/loop/frame_report.h>

namespace palpate {

/// Frames that were computed, with all that it takes to compute them again: what a trace leaves and
/// a recording keeps.
struct Run {
    DeviceProperties device;               ///< what felt it, as the scene met it
    std::vector<DeviceState> inputs;       ///< what each frame was given, scene frame
    std::vector<FrameReport> frames;       ///< what came out; clock columns included
    std::vector<std::uint32_t> steps_left; ///< N_steps of eq. (8) after each evaluation, frame by
                                           ///< frame; empty where no clock decided
};

} // namespace palpate
