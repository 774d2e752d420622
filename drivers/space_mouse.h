// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include <palpate/drivers/haptic_device.h>

namespace palpate {

/// How a deflected cap moves the probe.
struct SpaceMouseSettings {
    double speed_m_per_s = 0.1;  ///< of the probe where the cap is pushed all the way, > 0
    double turn_rad_per_s = 0.0; ///< of the handle where the cap is turned all the way; 0: not
                                 ///< turned, >= 0
    double dead_zone = 0.05;     ///< of the full deflection that counts as none, 0 to below 1
    double silence_s = 0.1;      ///< a deflected cap that says nothing for so long is stale, > 0
    Box workspace_m{Vec3(-0.1), Vec3(0.1)}; ///< where the probe may get, device frame, m
};

} // namespace palpate
