// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include <palpate/engine/scene/internal/effect_room.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/haptics/stepping/clock.h>

/// What evaluations cost, measured on this machine.
namespace palpate::internal {

inline constexpr std::size_t kPerReading =
    10; // evaluations between two readings of the clock, whose cost is then below 1 %
inline constexpr double kPricedStiffness = 500.0; // N/m: any

/// Median us of `evaluate(from, to)` over successive points; 0 of fewer than two.        [setup]
template <class Evaluate>
double median_us(std::span<const Vec3> points, const Evaluate& evaluate) {
    if (points.size() < 2) return 0.0;
    const std::size_t each = std::min(kPerReading, points.size() - 1);
    SteadyClock clock;
    std::vector<double> readings;
    for (std::size_t i = 0; i + each < points.size(); i += each) {
        const double began = clock.now_us();
        for (std::size_t k = 0; k < each; ++k)
            evaluate(points[i + k], points[i + k + 1]);
        readings.push_back((clock.now_us() - began) / static_cast<double>(each));
    }
    std::nth_element(readings.begin(), readings.begin() + readings.size() / 2, readings.end());
    return readings[readings.size() / 2];
}

/// What is evaluated beside a surface's planes.
enum class PricedWork { planes, solution };

/// What an evaluation costs that feels a surface, as the proxy goes along it, us; with a magnet
/// that holds it, where there is one.                                                   [setup]
double contact_price(const PricedSurface& priced, PricedWork work, const SurfaceMagnet& magnet);
/// The same of the surface as if nothing but itself were felt on it: without its texture. [setup]
double bare_price(const PricedSurface& priced);

} // namespace palpate::internal
