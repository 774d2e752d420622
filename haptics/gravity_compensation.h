// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <stdexcept>

#include <palpate/haptics/effect.h>

namespace palpate {

/// Carries the weight of the device's handle, so that the hand need not: -m g on the device, beside
/// the coupling, always. Scene frame.
class GravityCompensation final : public Effect {
public:
    static constexpr double kStandardGravity = 9.80665; ///< m/s^2

    /// `mass_kg`: kg, >= 0; `down`: the direction of gravity, of any length. Throws
    /// std::invalid_argument on what is not finite, a mass below 0, no direction.      [setup]
    GravityCompensation(double mass_kg, const Vec3& down) {
        if (!(mass_kg >= 0.0) || !std::isfinite(mass_kg))
            throw std::invalid_argument(
                "gravity compensation: its mass must be 0 kg or more, and finite");
        const double length = glm::length(down);
        if (!(length > 0.0) || !std::isfinite(length))
            throw std::invalid_argument(
                "gravity compensation: the direction of gravity must be finite and not zero");
        force_n_ = -mass_kg * kStandardGravity * (down / length);
    }

    void begin(const FrameContext&) noexcept override {}
    void gather(const Vec3&, PrimitiveSet&) noexcept override {}
    Vec3 device_force_n() const noexcept override { return force_n_; }
    QueryCount queries() const noexcept override { return {}; }

private:
    Vec3 force_n_{0.0};
};

} // namespace palpate
