// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/engine/scene/effects/kind.h>
#include <palpate/geometry/vec.h>

namespace palpate::effects {

/// The same force everywhere (haptics/effects/constant_force.h).
struct ConstantForce {
    Vec3 force_n{0.0}; ///< N, scene frame, each component in [-1e3, 1e3]

    static const internal::EffectRoom<ConstantForce> room;
};

} // namespace palpate::effects
