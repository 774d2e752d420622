// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>

#include <palpate/haptics/effects/effect.h>
#include <palpate/haptics/effects/local_strength.h>

namespace palpate {

/// A medium that resists the proxy's movement in proportion to its velocity:
///   b/(2T) |x' - x0|^2                                                        composition.md 1
/// with b in N s/m, T the nominal frame period and x0 the proxy at the frame's start: a spring of b
/// / T, an exact shift and scale of the coupling (implicit Euler, first order in T). It is anchored
/// at the frame's start, so that it does not depend on how many sub-steps a frame has; anchored at
/// the sub-steps it would fade as they grow in number. In steady movement the hand feels b v.
class Viscosity final : public Effect {
public:
    /// The same everywhere: b in N s/m, >= 0, finite. Throws std::invalid_argument where it is not.
    /// [setup]
    explicit Viscosity(double damping) : damping_(checked(damping)) {}

    /// b over the value of a field at the frame's start: the function's strengths are N s/m, >= 0,
    /// finite; nothing is felt where the field has no data. Throws std::invalid_argument where they
    /// are not, and where there is no field.                                           [setup]
    Viscosity(std::shared_ptr<const ScalarField> field, const TransferFunction& damping)
        : damping_(0.0, {required("viscosity: field", std::move(field)), damping}) {}

    void begin(const FrameContext& frame) noexcept override {
        start_ = frame.start;
        // After silence the way to here took more than a period, and nobody knows how much more.
        const double damping = damping_.at(frame.start);
        spring_n_per_m_ = frame.after_silence ? 0.0 : damping / frame.period_s;
    }
    void gather(const Vec3&, PrimitiveSet& primitives) noexcept override {
        if (spring_n_per_m_ > 0.0) primitives.add_spring(start_, spring_n_per_m_);
    }
    std::size_t most_primitives() const noexcept override { return 0; }
    QueryCount queries() const noexcept override { return {damping_.samples(), 0, 0}; }

private:
    static double checked(double damping) {
        require("viscosity: damping", damping, kNotNegative);
        return damping;
    }

    LocalStrength damping_; // N s/m
    Vec3 start_{0.0};
    double spring_n_per_m_ = 0.0;
};

} // namespace palpate
