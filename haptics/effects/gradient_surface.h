// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>

#include <palpate/haptics/effects/effect.h>
#include <palpate/volume/scalar_field.h>
#include <palpate/volume/transfer_function.h>

namespace palpate {

/// The paper's own surface mode: a plane through the current proxy, its normal against the field's
/// gradient, its strength from a transfer function of the value there. It has no memory of a level,
/// so what a step misses is lost: the drift that subdivision divides by the number of sub-steps
/// (numerics 2.1).
class GradientSurface final : public Effect {
public:
    /// Strength in N over the field's value. Throws std::invalid_argument where it is below 0, and
    /// where there is no field.                                                        [setup]
    GradientSurface(std::shared_ptr<const ScalarField> field, const TransferFunction& strength)
        : field_(required("gradient_surface: field", std::move(field))),
          strength_(strength.check("gradient_surface: strength", kNotNegativeOrInfinite)),
          sampler_(field_->make_sampler()) {}

    void begin(const FrameContext&) noexcept override {}
    void gather(const Vec3& proxy, PrimitiveSet& primitives) noexcept override {
        const FieldSample here = sampler_->sample(proxy);
        const double length = glm::length(here.gradient);
        if (!here.valid || !(length > 0.0)) return;
        const double strength = strength_(here.value);
        if (strength > 0.0) primitives.add({proxy, -here.gradient / length, strength});
    }
    QueryCount queries() const noexcept override {
        return {sampler_->samples(), sampler_->roots(), 0};
    }

private:
    std::shared_ptr<const ScalarField> field_;
    TransferFunction strength_;
    std::unique_ptr<FieldSampler> sampler_;
};

} // namespace palpate
