// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <palpate/engine/scene/effects/kind.h>
#include <palpate/geometry/vec.h>
#include <palpate/haptics/choices.h>
#include <palpate/volume/transfer_function.h>

namespace palpate::effects {

/// Heights in front of a surface's level: of a pattern, or over the value of a volume
/// (haptics/contact/surface_texture.h).
struct Texture {
    std::string surface = {};                       ///< felt with contact `volume` or `guarded`
    TexturePattern pattern = TexturePattern::bumps; ///< unused with `volume`
    double height_m = 0.0;      ///< of the highest crests: m, [0, wavelength_m / (2 pi)]
    double wavelength_m = 2e-3; ///< m, (0, 1]
    Vec3 direction{1, 0, 0};    ///< of a grating: across its grooves, scene frame, any length > 0
    std::string volume = {};    ///< of scalars; empty: a pattern
    TransferFunction height_over_value = {}; ///< with `volume`, instead of a pattern: its strengths
                                             ///< are heights in m over the volume's value, [0, 1]

    static const internal::EffectRoom<Texture> room;
};

} // namespace palpate::effects
