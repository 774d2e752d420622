// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/geometry/range.h>
#include <palpate/haptics/effects/effect.h>

namespace palpate {

/// Carries the weight of the device's handle, so that the hand need not: -m g on the device, beside
/// the coupling, whose limits and softening it shares. Scene frame.
class GravityCompensation final : public Effect {
public:
    static constexpr double kStandardGravity = 9.80665; ///< m/s^2

    /// `mass_kg`: kg, >= 0; `down`: the direction of gravity, of any length. Throws
    /// std::invalid_argument on what is not finite, a mass below 0, no direction.      [setup]
    GravityCompensation(double mass_kg, const Vec3& down) {
        require("gravity_compensation: mass_kg", mass_kg, kNotNegative);
        require_direction("gravity_compensation: down", down);
        force_n_ = -mass_kg * kStandardGravity * (down / glm::length(down));
    }

    void begin(const FrameContext&) noexcept override {}
    void gather(const Vec3&, PrimitiveSet&) noexcept override {}
    Vec3 device_force_n() const noexcept override { return force_n_; }
    double unasked_force_n() const noexcept override { return glm::length(force_n_); }
    bool only_pushes() const noexcept override { return true; }
    std::size_t most_primitives() const noexcept override { return 0; }
    QueryCount queries() const noexcept override { return {}; }

private:
    Vec3 force_n_{0.0};
};

} // namespace palpate
