// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <string>

#include <palpate/engine/scene/effects/kind.h>
#include <palpate/volume/transfer_function.h>

namespace palpate::effects {

/// A plane through the proxy, against a volume's gradient: without a mesh and without a
/// certificate (haptics/effects/gradient_surface.h).
struct GradientSurface {
    std::string volume = {}; ///< of scalars
    TransferFunction strength = TransferFunction::constant(std::numeric_limits<double>::infinity());
    ///< N over the volume's value, [0, 1e6] or, as a single number, infinite

    static const internal::EffectRoom<GradientSurface> room;
};

} // namespace palpate::effects
