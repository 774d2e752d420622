// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <palpate/engine/scene/effects/kind.h>
#include <palpate/volume/transfer_function.h>

namespace palpate::effects {

/// A surface draws the proxy onto itself from in front (haptics/effects/surface_magnets.h).
struct Magnet {
    std::string surface = {}; ///< key of SceneDescription::surfaces
    double strength_n = 0.0;  ///< that it takes to pull the proxy off, N, [0, 1e3]; with `volume`
                              ///< not read, as it is the greatest of `strength`
    double capture_m = 1e-3;  ///< it snaps on when the proxy is this near at a frame's start: m,
                              ///< (0, 1]
    std::string volume = {};  ///< of scalars; empty: the strength is the same everywhere
    TransferFunction strength = {}; ///< with `volume`: N over its value, [0, 1e3]

    static const internal::EffectRoom<Magnet> room;
};

} // namespace palpate::effects
