// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include <palpate/drivers/haptic_device.h>

namespace palpate::internal {

/// How far the cap of a 3Dconnexion device is pushed and turned: -1 to 1 a direction, device
/// frame. The device itself counts x to the right, y towards the user, z down; here as for every
/// device x is towards the user, y to the right, z up, which is a rotation: translations and
/// rotations change alike.
struct SpaceMouseDeflection {
    Vec3 push{0.0}; ///< along the axes
    Vec3 turn{0.0}; ///< about the axes, right-handed
};

/// What such a device has said so far.
struct SpaceMouseReading {
    SpaceMouseDeflection deflection;
    std::uint32_t buttons = 0;                   ///< bit i: button i, as the device numbers them
    std::optional<std::uint8_t> battery_percent; ///< wireless ones
};

/// What a report was about.
enum class SpaceMouseNews { nothing, motion, buttons, battery };

/// Takes a report in, which begins with its id. Its length says what it holds, never the product:
/// motion of 13 bytes carries translation and rotation, of 7 bytes one of them. What is shorter or
/// unknown changes nothing.                                                             [any]
SpaceMouseNews take_space_mouse_report(std::span<const std::uint8_t> report,
                                       SpaceMouseReading& reading) noexcept;

} // namespace palpate::internal
