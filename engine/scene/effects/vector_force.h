// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <palpate/engine/scene/effects/kind.h>
#include <palpate/volume/transfer_function.h>

namespace palpate::effects {

/// A force along a volume's vectors (haptics/effects/vector_force.h).
struct VectorForce {
    std::string volume = {};        ///< of vectors
    TransferFunction strength = {}; ///< N over the vector's length, [0, 1e3]; has to be given

    static const internal::EffectRoom<VectorForce> room;
};

} // namespace palpate::effects
