// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <palpate/geometry/vec.h>

namespace palpate {

/// What a haptic device says at one instant, in the scene frame, SI.
struct DeviceState {
    double time_s = 0.0;     ///< the device's own time
    Vec3 position{0.0};      ///< probe, m
    Vec3 velocity{0.0};      ///< m/s; zero where the device knows none
    std::uint32_t trial = 0; ///< a new number restarts the proxy at the probe
};

/// Anything that has a probe and may take a force.
class HapticDevice {
public:
    virtual ~HapticDevice() = default;

    /// The next state; false when there is none any more (the end of a path).            [loop]
    virtual bool read(DeviceState& state) noexcept = 0;

    /// The force on the hand, N, scene frame, after the limits.                          [loop]
    virtual void write(const Vec3& force) noexcept = 0;
};

} // namespace palpate
