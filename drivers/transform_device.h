// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include <palpate/drivers/haptic_device.h>
#include <palpate/drivers/igtl_message.h>

namespace palpate {

/// What came for a TransformDevice.
struct TransformCounts {
    std::uint64_t used = 0;   ///< poses
    std::uint64_t faulty = 0; ///< that tool_pose() finds nowhere: thrown away
};

/// A tool whose pose comes as a TRANSFORM of OpenIGTLink, some ten times a second, as a probe
/// without force. Its frame is the scene's.
///
/// A loop reads it far more often than a pose comes. So the probe goes from one pose to the next at
/// an even speed, in the time that lay between the two: it is late by that time, and does not jump.
/// Nothing for kSilence_s is stale, and the probe stands. Before the first pose it is stale, and
/// the first pose, also the first one after a silence, begins a new trial where it is.
class TransformDevice final : public HapticDevice {
public:
    static constexpr double kSilence_s = 0.25; ///< four periods of a slow tracker (16 Hz), s

    /// A clock that never goes back, s.
    using Clock = std::function<double()>;

    /// `name`: of the TRANSFORM, for people.                                            [setup]
    explicit TransformDevice(std::string name);
    /// The same with another clock.                                                     [setup]
    TransformDevice(std::string name, Clock clock);
    ~TransformDevice() override;

    /// A new pose, from one thread at a time; never waits.                                 [any]
    void give(const IgtlTransform& transform) noexcept;
    TransformCounts counts() const noexcept; ///< since it was made                       [any]

    /// What was of no use, in words; empty: nothing was.                                 [setup]
    std::string complaint() const;

    DeviceProperties properties() const override;
    bool read(DeviceState& state) noexcept override;
    void write(const Vec3&) noexcept override {} ///< it has no motors

private:
    class Tool;
    std::unique_ptr<Tool> tool_;
};

} // namespace palpate
