// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/haptics/effect.h>

namespace palpate {

/// A force that is felt everywhere, N, scene frame: the force primitive, an exact shift of the
/// probe (composition.md 1).
class ConstantForce final : public Effect {
public:
    explicit ConstantForce(const Vec3& force) noexcept : force_(force) {}
    void begin(const FrameContext&) noexcept override {}
    void gather(const Vec3&, PrimitiveSet& primitives) noexcept override {
        primitives.add_force(force_);
    }
    QueryCount queries() const noexcept override { return {}; }

private:
    Vec3 force_;
};

} // namespace palpate
