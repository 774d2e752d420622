// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include <palpate/drivers/haptic_device.h>

namespace palpate {

/// How a deflected cap moves the probe.
struct SpaceMouseSettings {
    std::string path;            ///< of the node, "/dev/hidraw0"; empty: the first one
    double speed_m_per_s = 0.1;  ///< of the probe where the cap is pushed all the way, > 0
    double turn_rad_per_s = 0.0; ///< of the handle where the cap is turned all the way; 0: not
                                 ///< turned, >= 0
    double dead_zone = 0.05;     ///< of the full deflection that counts as none, 0 to below 1
    double silence_s = 0.1;      ///< a deflected cap that says nothing for so long is stale, > 0
    double reconnect_s = 1.0;    ///< between two looks for a device that is gone, > 0
    Box workspace_m{Vec3(-0.1), Vec3(0.1)}; ///< where the probe may get, device frame, m
};

/// A 3Dconnexion device as a probe without force: the cap's deflection is the probe's speed, within
/// a box in whose middle it begins. Its lamp is lit while it is open.
///
/// It says nothing while its cap is at rest, and the state is fresh then; deflected it goes on
/// saying so, and its silence is stale: the probe stands. Unplugged it is stale, and looked for.
class SpaceMouseDevice final : public HapticDevice {
public:
    /// Throws std::invalid_argument that names the setting.                             [setup]
    explicit SpaceMouseDevice(SpaceMouseSettings settings = {});
    ~SpaceMouseDevice() override;

    DeviceProperties properties() const override;
    void open() override;
    void start() override;
    void stop() noexcept override;
    void close() noexcept override;
    bool read(DeviceState& state) noexcept override;
    void write(const Vec3&) noexcept override {} ///< it has no motors

private:
    class Mouse;
    std::unique_ptr<Mouse> mouse_;
};

} // namespace palpate
