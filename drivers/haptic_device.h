// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <string>

#include <palpate/geometry/vec.h>

namespace palpate {

/// Whether a state tells of now.
enum class Freshness : std::uint8_t {
    fresh, ///< the device said it in time, or is known to say nothing where nothing changes
    stale  ///< the last one known: the device has been silent for longer than it may be
};

/// What a haptic device says at one instant, in the device's own frame, SI. The frame of a path,
/// an orbit or a recording is the scene's.
struct DeviceState {
    double time_s = 0.0;       ///< the device's own time; always 0: VelocityEstimator counts
    Vec3 position{0.0};        ///< m
    Vec3 velocity{0.0};        ///< m/s; zero where the device knows none
    std::uint32_t trial = 0;   ///< a new number restarts the proxy at the probe
    std::uint32_t buttons = 0; ///< bit i: button i is down
    Freshness freshness = Freshness::fresh;     ///< stale: the force goes to zero
    Quaternion orientation{1.0, 0.0, 0.0, 0.0}; ///< handle to device; the identity where the
                                                ///< device knows none
};

/// Where the velocity of a device that takes forces comes from.
enum class VelocitySource : std::uint8_t {
    positions, ///< it is estimated; DeviceState::velocity is not looked at
    device     ///< the device measures it: DeviceState::velocity
};

/// What a device declares of itself. What it does not know has no limit.
struct DeviceProperties {
    std::string name;     ///< for people: model, and what tells it from another one
    double force_n = 0.0; ///< longest force that it can hold, N; 0: it takes none
    double stiffness_n_per_m =
        std::numeric_limits<double>::infinity(); ///< stiffest coupling that it is made for, N/m
    double damping_n_s_per_m = 0.0; ///< its own, mechanical one, N s/m: what pays for the energy
                                    ///< that a sampled spring gives (k T / 2 <= b)
    Box workspace_m{};              ///< where its handle gets, device frame, m; empty: anywhere
    double position_step_m = 0.0;   ///< what its positions are rounded to, m; 0: they are exact
    double delay_s = 0.0; ///< from a movement until the force that answers it is at work, beyond
                          ///< the frame itself: reading, writing, transport, s
    VelocitySource velocity_source = VelocitySource::positions; ///< of one that takes forces
    double scale = 1.0; ///< m of the scene per m of the hand, [0.01, 100]; a driver leaves it at 1.
                        ///< Who sets it sets all as the scene meets it: DevicePlacement::to_scene()
};

/// Anything that has a probe and may take a force. Opened, started, read and written in turn at
/// each frame, stopped, closed; a device that holds nothing has nothing to do for the first and
/// the last two.
class HapticDevice {
public:
    virtual ~HapticDevice() = default;

    /// Known once it is open.                                                           [setup]
    virtual DeviceProperties properties() const = 0;

    /// Finds the hardware and makes sure that it is what it should be; moves nothing. Throws
    /// std::runtime_error that says what is in the way and how to mend it.              [setup]
    virtual void open() {}
    /// From here on it is read and written.                                             [setup]
    virtual void start() {}
    /// The force is zero when this returns, or the device out of reach. Also after a failure, and
    /// more than once.                                                                  [setup]
    virtual void stop() noexcept {}
    /// Gives the hardware back; stops it first where that has not been done.            [setup]
    virtual void close() noexcept {}

    /// The newest state, without waiting for one; false when there is none any more (the end of a
    /// path).                                                                            [loop]
    virtual bool read(DeviceState& state) noexcept = 0;

    /// The force on the hand, N, device frame, after the limits. Does not wait.          [loop]
    virtual void write(const Vec3& force) noexcept = 0;
};

} // namespace palpate
