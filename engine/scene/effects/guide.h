// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include <palpate/engine/scene/effects/kind.h>
#include <palpate/geometry/vec.h>
#include <palpate/haptics/choices.h>
#include <palpate/volume/transfer_function.h>

namespace palpate::effects {

/// Draws the proxy onto a point or onto a polyline (haptics/effects/point_guide.h, curve_guide.h).
struct Guide {
    std::vector<Vec3> points_m = {}; ///< one point, or the polyline's corners, up to
                                     ///< Polyline::kMostPoints, scene frame, m, within 1e3
    std::filesystem::path file = {}; ///< CSV file of the points; empty: the scene itself has them
    PolylineEnds ends = PolylineEnds::open; ///< beyond the first and last point
    double strength_n =
        1.0; ///< N, [0, 1e6] or infinite: then the proxy never slips off, and the
             ///< guide never lets go. With `volume`: not read, as it is the greatest of `strength`
    double capture_m = std::numeric_limits<double>::infinity();
    ///< m, > 0: the guide takes the proxy if it is this near at a frame's start; infinite: always
    std::string volume = {};        ///< of scalars; empty: the strength is the same everywhere
    TransferFunction strength = {}; ///< with `volume`: N as a function of the volume's value,
                                    ///< [0, 1e6], finite

    static const internal::EffectRoom<Guide> room;
};

} // namespace palpate::effects
