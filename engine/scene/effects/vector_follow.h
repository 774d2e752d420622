// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <string>

#include <palpate/engine/scene/effects/kind.h>
#include <palpate/haptics/choices.h>
#include <palpate/volume/transfer_function.h>

namespace palpate::effects {

/// Movement along a volume's vectors is free, across them it is not
/// (haptics/effects/vector_follow.h).
struct VectorFollow {
    std::string volume = {}; ///< of vectors
    TransferFunction strength = TransferFunction::constant(std::numeric_limits<double>::infinity());
    ///< N over the vector's length, [0, 1e6] or, as a single number, infinite
    FollowGuide guide = FollowGuide::streamline; ///< what leads within a frame

    static const internal::EffectRoom<VectorFollow> room;
};

/// The same along fibres, whose direction has no sign.
struct FibreFollow {
    std::string volume = {}; ///< of vectors or tensors
    TransferFunction strength = TransferFunction::constant(std::numeric_limits<double>::infinity());
    ///< N over the vector's length, [0, 1e6] or, as a single number, infinite
    FollowGuide guide = FollowGuide::streamline; ///< what leads within a frame

    static const internal::EffectRoom<FibreFollow> room;
};

} // namespace palpate::effects
