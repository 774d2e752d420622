// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/engine/scene/effects/kind.h>
#include <palpate/geometry/vec.h>

namespace palpate::effects {

/// Carries the weight of the device's handle (haptics/effects/gravity_compensation.h).
struct GravityCompensation {
    double mass_kg = 0.0; ///< of the handle, kg, [0, 100]
    Vec3 down{0.0};       ///< the direction of gravity, scene frame, of any length > 0

    static const internal::EffectRoom<GravityCompensation> room;
};

} // namespace palpate::effects
