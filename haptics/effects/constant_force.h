// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/geometry/range.h>
#include <palpate/haptics/effects/effect.h>

namespace palpate {

/// A force that is felt everywhere, N, scene frame: the force primitive, an exact shift of the
/// probe (composition.md 1).
class ConstantForce final : public Effect {
public:
    /// Throws std::invalid_argument where it is not finite.                             [setup]
    explicit ConstantForce(const Vec3& force) : force_(force) {
        require_finite("constant_force: force", force);
    }
    void begin(const FrameContext&) noexcept override {}
    void gather(const Vec3&, PrimitiveSet& primitives) noexcept override {
        primitives.add_force(force_);
    }
    double unasked_force_n() const noexcept override { return glm::length(force_); }
    bool only_pushes() const noexcept override { return true; }
    std::size_t most_primitives() const noexcept override { return 0; }
    QueryCount queries() const noexcept override { return {}; }

private:
    Vec3 force_;
};

} // namespace palpate
