// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <string>

#include <palpate/engine/scene/effects/kind.h>
#include <palpate/volume/transfer_function.h>

namespace palpate::effects {

/// Movement across a volume's vectors is free, along them it is not
/// (haptics/effects/vector_sheet.h).
struct FrontShape {
    std::string volume = {}; ///< of vectors
    TransferFunction strength = TransferFunction::constant(std::numeric_limits<double>::infinity());
    ///< N over the vector's length, [0, 1e6] or, as a single number, infinite

    static const internal::EffectRoom<FrontShape> room;
};

/// Movement around the axis of rotation of a volume's vectors is free
/// (haptics/effects/vector_sheet.h).
struct Vortex {
    std::string volume = {}; ///< of vectors
    TransferFunction strength = TransferFunction::constant(std::numeric_limits<double>::infinity());
    ///< N over the vector's length, [0, 1e6] or, as a single number, infinite

    static const internal::EffectRoom<Vortex> room;
};

} // namespace palpate::effects
