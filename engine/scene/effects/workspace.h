// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <string>

#include <palpate/engine/scene/effects/kind.h>
#include <palpate/geometry/vec.h>
#include <palpate/volume/transfer_function.h>

namespace palpate::effects {

/// The proxy stays within a ball or a box (haptics/effects/workspace.h).
struct Workspace {
    double radius_m = 0.0; ///< of a ball: m, (0, 1e3]; 0: a box
    Vec3 center_m{0.0};    ///< of the ball: m, scene frame, within 1e3
    Box box_m = {};        ///< m, scene frame, within 1e3; with a volume of its own
    double strength_n = std::numeric_limits<double>::infinity();
    ///< N, [0, 1e6] or infinite: it never yields; with `volume` not read, as it is the
    ///< greatest of `strength`
    std::string volume = {};        ///< of scalars; empty: the strength is the same everywhere
    TransferFunction strength = {}; ///< with `volume`: N over its value, [0, 1e6], finite

    static const internal::EffectRoom<Workspace> room;
};

} // namespace palpate::effects
