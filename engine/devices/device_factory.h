// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/scene/device_placement.h>
#include <palpate/engine/scene/scene.h>

namespace palpate {

/// What is in the way of a device: none attached, no permission, another program has it.
struct DeviceError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// True where a scene's device is known from beginning to end: a path, an orbit, a tour, a
/// recording. [any]
bool is_sequence(const DeviceDescription& device) noexcept;

/// True where a device can go along its path K times as fast: a path, an orbit, a hand that
/// follows a path. [any]
bool takes_every(const DeviceDescription& device) noexcept;

/// The states of a scene's sequence, scene frame.                                       [setup]
/// `every` = K takes each K-th row of a path, or goes around an orbit K times as fast. Throws
/// std::runtime_error that says what the scene has instead, or what is wrong with the file;
/// std::invalid_argument where every < 1, or every > 1 and not takes_every().
/// `notes`: replaced by what a user should know of a path that was generated, a line each.
std::vector<DeviceState> device_states(const Scene& scene, int every = 1,
                                       std::vector<std::string>* notes = nullptr);

/// A device and how it stands to the scene.
struct PlacedDevice {
    HapticDevice& device;      ///< speaks the device frame
    DevicePlacement placement; ///< device frame to scene frame
};

/// The device that a scene names.
struct SceneDevice {
    std::unique_ptr<HapticDevice> device; ///< not started; null where the scene names none
    DevicePlacement placement;            ///< the identity for sequences
    std::uint64_t states = std::numeric_limits<std::uint64_t>::max(); ///< that a sequence has
    std::vector<std::string> notes = {}; ///< what a user should know of a path that was generated

    /// Refers to `device`, which must not be null and must outlive the result.              [any]
    PlacedDevice placed() const { return {*device, placement}; }
};

/// The device of a scene; not open yet. `every` as for device_states().                 [setup]
/// Throws as device_states(), and std::runtime_error where this version has no such device.
SceneDevice make_device(const Scene& scene, int every = 1);

/// What a device did in its last run that was of no use, one line with the remedy; empty: nothing,
/// or the device does not tell.                                                          [setup]
std::string device_complaint(const HapticDevice& device);

/// Whether a device whose silence may be meant, a tool that rests, says itself that it has failed.
/// [setup]
bool has_failed(const HapticDevice& device);

/// A device from open() to close(): whatever happens to its owner, it is sent a zero force, stopped
/// and closed, in that order.
class RunningDevice {
public:
    /// Opens and starts it; throws DeviceError with the device's own words.             [setup]
    explicit RunningDevice(HapticDevice& device);
    ~RunningDevice();
    RunningDevice(const RunningDevice&) = delete;
    RunningDevice& operator=(const RunningDevice&) = delete;

private:
    HapticDevice& device_;
};

} // namespace palpate
