// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/loop/run.h>
#include <palpate/engine/scene/scene_overrides.h>

namespace palpate::c {

/// The frames of a loop from its first one on, as many as there is room for. A run of which a part
/// is missing cannot be computed again: so it ends at the first frame that is not kept.
class LoopRecord {
public:
    /// Takes all its memory. `overrides`: what the loop has otherwise than its scene.   [setup]
    LoopRecord(std::size_t frames, const DeviceProperties& device, SteppingMethod method,
               SceneOverrides overrides);

    /// What the loop's last frame was given, and what came of it.                       [loop]
    void add(const DeviceState& input, const FrameReport& frame, const HapticLoop& loop) noexcept;
    /// What follows is not the same run any more.                                       [loop]
    void end() noexcept { has_ended_ = true; }

    const Run& run() const noexcept { return run_; }
    const SceneOverrides& overrides() const noexcept { return overrides_; }

private:
    Run run_;
    SceneOverrides overrides_;
    bool keeps_steps_;
    bool has_ended_ = false;
};

} // namespace palpate::c
