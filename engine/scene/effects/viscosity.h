// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <palpate/engine/scene/effects/kind.h>
#include <palpate/volume/transfer_function.h>

namespace palpate::effects {

/// A medium that resists movement (haptics/effects/viscosity.h): everywhere, over a volume's value,
/// or inside of a surface.
struct Viscosity {
    std::string volume = {}; ///< of scalars; empty: the same everywhere, or in `surface`
    std::string surface =
        {}; ///< of a volume; empty where there is `volume`, or where it is everywhere
    TransferFunction strength = {}; ///< a damping: N s/m over the volume's value, [0, 1e3]; one
                                    ///< number without `volume`; has to be given

    static const internal::EffectRoom<Viscosity> room;
};

} // namespace palpate::effects
