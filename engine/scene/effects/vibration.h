// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <palpate/engine/scene/effects/kind.h>

namespace palpate::effects {

/// A decaying vibration after each impact (haptics/effects/contact_vibration.h).
struct Vibration {
    std::string surface = {};         ///< that it answers; empty: all of them
    double amplitude_n_s_per_m = 5.0; ///< N per m/s of approach, [0, 1e3]
    double frequency_hz = 150.0;      ///< Hz, (0, 1e4], below half of LoopDescription::rate_hz
    double decay_s = 0.02;            ///< s, (0, 10]
    double most_n = 2.0;              ///< the force is never above this, N, [0, 1e3]

    static const internal::EffectRoom<Vibration> room;
};

} // namespace palpate::effects
