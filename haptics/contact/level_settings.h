// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include <palpate/haptics/choices.h>
#include <palpate/volume/scalar_field.h>

namespace palpate {

/// An isosurface of a field as something to touch.
struct LevelSettings {
    double level = 0.0; ///< c, the field's unit U; free where the value is below
    double strength_n = std::numeric_limits<double>::infinity(); ///< yields above, N, > 0
    double certificate_m = 25e-6; ///< tau as a length: no chord goes deeper, m, > 0 (contact.md
                                  ///< 1.6: less stalls on CT); an eighth of the field's feature
                                  ///< size where that is less
    double free_m = 5e-6; ///< further than this in front of the level nothing is felt, m, > 0
    Yielding yielding = Yielding::holds; ///< what it does above its strength
};

/// What of a level the contacts measure once: tolerances in the field's unit (contact.md 1.6).
struct LevelScale {
    double certificate = 0.0;       ///< tau, U: that times the typical slope
    double smallest_gradient = 0.0; ///< U/m, 5 % of the typical slope: below, the normal is noise
    double free = 0.0;              ///< free_m as tau, U
    double trust_m = 0.0;           ///< half the field's feature size
    double typical_slope = 0.0;     ///< at the level, U/m

    /// Throws std::invalid_argument when the field never passes the level or a setting is out of
    /// range.   [setup]
    static LevelScale of(const ScalarField& field, const LevelSettings& settings);
};

} // namespace palpate
