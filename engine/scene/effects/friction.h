// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <palpate/engine/scene/effects/kind.h>

namespace palpate::effects {

/// Coulomb friction on a surface (haptics/effects/coulomb_friction.h).
struct Friction {
    std::string surface = {}; ///< key of SceneDescription::surfaces
    double static_mu = 0.0;   ///< at rest, no unit, [dynamic_mu, 10]
    double dynamic_mu = 0.0;  ///< while sliding, no unit, [0, static_mu]

    static const internal::EffectRoom<Friction> room;
};

/// The same, and it comes to rest after each slip: the force saws between the two.
struct StickSlip {
    std::string surface = {}; ///< key of SceneDescription::surfaces
    double static_mu = 0.0;   ///< at rest, no unit, [dynamic_mu, 10]
    double dynamic_mu = 0.0;  ///< while sliding, no unit, [0, static_mu]

    static const internal::EffectRoom<StickSlip> room;
};

} // namespace palpate::effects
