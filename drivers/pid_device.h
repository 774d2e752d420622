// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include <palpate/drivers/haptic_device.h>

namespace palpate {

/// What a stick with force feedback does not say of itself.
struct PidSettings {
    std::string path;        ///< of the node, "/dev/hidraw0"; empty: the first one
    double force_n = 2.0;    ///< at the grip where its motors do their most, > 0
    double reach_m = 0.05;   ///< of the grip from its middle to where the stick's axes end, > 0
    double towards_sign = 1; ///< 1 or -1: -1 where a force towards the user goes the other way
    double right_sign = 1;   ///< 1 or -1: likewise to the right
    double stiffness_n_per_m = 200.0; ///< stiffest coupling: these motors are told of forces
                                      ///< through a slow interface, > 0
    double damping_n_s_per_m = 0.5;   ///< of its bearings and gears, >= 0
    double stale_after_s = 0.006;      ///< silence, of it or its motors, after which a state is
                                      ///< stale, > 0; longer for sticks that speak on change only
    double force_hold_s = 0.02;       ///< how long the last force is held; then it is zero, > 0
    double reconnect_s = 1.0;         ///< between two looks for a device that is gone, > 0
};

/// A stick with force feedback (USB PID): two dimensions of position and force, towards the user
/// and to the right; its forces are two constant effects, one an axis, whose magnitudes change.
/// Told of about 500 forces a second. What its reports look like is read from the device itself.
///
/// The state is stale where the stick is silent or takes no force; unplugged it is looked for. Its
/// motors are without force unless state and force are recent, and switched off by stop().
class PidDevice final : public HapticDevice {
public:
    /// Throws std::invalid_argument that names the setting.                             [setup]
    explicit PidDevice(PidSettings settings = {});
    ~PidDevice() override;

    DeviceProperties properties() const override;
    void open() override;
    void start() override;
    void stop() noexcept override;
    void close() noexcept override;
    bool read(DeviceState& state) noexcept override;
    void write(const Vec3& force) noexcept override;

private:
    class Stick;
    std::unique_ptr<Stick> stick_;
};

} // namespace palpate
