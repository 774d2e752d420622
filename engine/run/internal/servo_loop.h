// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <limits>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/loop/run.h>
#include <palpate/engine/run/internal/spsc_ring.h>
#include <palpate/engine/run/paced_clock.h>
#include <palpate/engine/run/run_watch.h>
#include <palpate/engine/scene/device_placement.h>

namespace palpate::internal {

struct ServoSettings {
    double period_us = 1000.0;
    std::uint64_t most_frames = std::numeric_limits<std::uint64_t>::max();
    double longest_us = std::numeric_limits<double>::infinity(); ///< of the clock
    bool takes_force = false; ///< the device: its force is led to zero where the run ends
};

/// The frames of a run at the clock's pace: wait, read, frame, write, hand over. Below run() there
/// is no allocation and no lock, and no system call but the wait and the device's own.
class ServoLoop {
public:
    /// A force that the loop has not renewed for that long is not to be trusted: the next state
    /// counts as stale, in the recording as well.
    static constexpr double kLongestGap_us = 10e3;
    static constexpr double kLongestGapPeriods = 2.5; ///< and no less, of a slow loop;
    static constexpr double kHeld_us = 20e3; ///< with motors no more: drivers hold no force longer
    /// When the run ends a force may take that long to get to zero; what is left then is cut.
    static constexpr double kRelease_us = 50e3;

    /// All of them must outlive it. `decisions` takes N_steps of eq. (8), where a replay needs
    /// them, for each evaluation, and `touches` what each frame touched; null: nobody does. [setup]
    ServoLoop(HapticLoop& loop, HapticDevice& device, const DevicePlacement& placement,
              PacedClock& clock, const ServoSettings& settings, SpscRing<RunFrame>& frames,
              SpscRing<std::uint32_t>* decisions,
              SpscRing<RecordedTouch>* touches = nullptr) noexcept;

    /// Until the device has no more states, a limit is reached or ask_to_stop(); the last thing
    /// that the device gets is a zero force.                                             [loop]
    void run() noexcept;

    /// From any thread, once or more.                                                    [any]
    void ask_to_stop() noexcept { asked_.store(true, std::memory_order_relaxed); }

    /// Frames for which the recorder left no room; they were felt all the same.          [any]
    std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

private:
    bool read(std::uint64_t periods, DeviceState& state) noexcept;
    Silence silence_of(const DeviceState& state, double gap_us) const noexcept;
    Vec3 to_be_sent(const Vec3& force, double gap_us, double began_us) noexcept;
    void hand_over(RunFrame& frame) noexcept;

    HapticLoop& loop_;
    HapticDevice& device_;
    const DevicePlacement& placement_;
    PacedClock& clock_;
    ServoSettings settings_;
    SpscRing<RunFrame>& frames_;
    SpscRing<std::uint32_t>* decisions_;
    SpscRing<RecordedTouch>* touches_;
    bool ending_ = false;
    bool was_let_go_ = false; ///< by the driver, of a force that still fades in the frames
    std::atomic<bool> asked_{false};
    std::atomic<std::uint64_t> dropped_{0};
    std::uint64_t missed_untold_ = 0; // periods, of frames that were dropped
};

} // namespace palpate::internal
