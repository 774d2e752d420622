// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <palpate/engine/scene/effects/kind.h>
#include <palpate/volume/transfer_function.h>

namespace palpate::effects {

/// A force against a volume's gradient (haptics/effects/gradient_force.h).
struct GradientForce {
    std::string volume = {};        ///< of scalars
    TransferFunction strength = {}; ///< N over the volume's value, [0, 1e3]; has to be given

    static const internal::EffectRoom<GradientForce> room;
};

} // namespace palpate::effects
