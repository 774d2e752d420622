// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>

#include <palpate/haptics/effects/effect.h>
#include <palpate/haptics/effects/frame_lag.h>
#include <palpate/volume/scalar_field.h>
#include <palpate/volume/transfer_function.h>

namespace palpate {

/// A force against the gradient, out of what is denser: the oldest way to feel a volume.
///   d = -s(f) grad f / |grad f|                                     force primitive, numerics 1.1
/// in N, with f the value at the proxy of the frame's start and s a transfer function: the force is
/// the same in all of the frame's sub-steps, an exact shift of the probe. Where the gradient nearly
/// vanishes its direction is noise: let s be 0 for the values of homogeneous regions. It follows
/// what the frames find as FrameLag says, so that a held probe settles, however steep s is.
class GradientForce final : public Effect {
public:
    /// Strength in N over the field's value, >= 0, finite. Throws std::invalid_argument where it
    /// is not, and where there is no field.                                            [setup]
    GradientForce(std::shared_ptr<const ScalarField> field, const TransferFunction& strength)
        : field_(required("gradient_force: field", std::move(field))),
          strength_(strength.check("gradient_force: strength", kNotNegative)),
          sampler_(field_->make_sampler()) {}

    void restart(const Vec3&) noexcept override { lag_.restart(); }
    void begin(const FrameContext& frame) noexcept override {
        Vec3 found{0.0};
        const FieldSample here = sampler_->sample(frame.start);
        const double length = glm::length(here.gradient);
        if (here.valid && length > 0.0) found = -strength_(here.value) / length * here.gradient;
        force_ = lag_.follow(found, frame);
    }
    void gather(const Vec3&, PrimitiveSet& primitives) noexcept override {
        primitives.add_force(force_);
    }
    double unasked_force_n() const noexcept override { return strength_.strongest(); }
    std::size_t most_primitives() const noexcept override { return 0; }
    QueryCount queries() const noexcept override {
        return {sampler_->samples(), sampler_->roots(), 0};
    }
    std::any save_state() const override { return lag_; }
    void restore_state(const std::any& state) override {
        lag_ = std::any_cast<const FrameLag<Vec3>&>(state);
    }

private:
    std::shared_ptr<const ScalarField> field_;
    TransferFunction strength_;
    std::unique_ptr<FieldSampler> sampler_;
    FrameLag<Vec3> lag_;
    Vec3 force_{0.0}; // N
};

} // namespace palpate
