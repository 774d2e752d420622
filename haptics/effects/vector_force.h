// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>

#include <palpate/haptics/effects/effect.h>
#include <palpate/haptics/effects/frame_lag.h>
#include <palpate/volume/transfer_function.h>
#include <palpate/volume/vector_field.h>

namespace palpate {

/// A force along the vector, as of a stream that carries the hand.
///   d = s(|v|) v / |v|                                              force primitive, numerics 1.1
/// in N, with v at the proxy of the frame's start and s a transfer function of its length: the same
/// in all of the frame's sub-steps, an exact shift of the probe. Only for fields with a sense. It
/// does work on a hand that goes with it, as the stream would: it is the one mode of vectors that
/// is not passive.
class VectorForce final : public Effect {
public:
    /// Strength in N over the vector's length, >= 0, finite. Throws std::invalid_argument where
    /// it is not, and where there is no field.                                         [setup]
    VectorForce(std::shared_ptr<const VectorField> field, const TransferFunction& strength)
        : field_(required("vector_force: field", std::move(field))),
          strength_(strength.check("vector_force: strength", kNotNegative)),
          sampler_(field_->make_sampler()) {}

    void restart(const Vec3&) noexcept override { lag_.restart(); }
    void begin(const FrameContext& frame) noexcept override {
        Vec3 found{0.0};
        const VectorSample here = sampler_->sample(frame.start);
        const double length = glm::length(here.value);
        if (here.valid && length > 0.0) found = strength_(length) / length * here.value;
        force_ = lag_.follow(found, frame);
    }
    void gather(const Vec3&, PrimitiveSet& primitives) noexcept override {
        primitives.add_force(force_);
    }
    double unasked_force_n() const noexcept override { return strength_.strongest(); }
    std::size_t most_primitives() const noexcept override { return 0; }
    QueryCount queries() const noexcept override { return {sampler_->samples(), 0, 0}; }
    std::any save_state() const override { return lag_; }
    void restore_state(const std::any& state) override {
        lag_ = std::any_cast<const FrameLag<Vec3>&>(state);
    }

private:
    std::shared_ptr<const VectorField> field_;
    TransferFunction strength_;
    std::unique_ptr<VectorSampler> sampler_;
    FrameLag<Vec3> lag_;
    Vec3 force_{0.0}; // N
};

} // namespace palpate
