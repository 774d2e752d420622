// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <palpate/engine/report/internal/series_chart.h>

namespace palpate::internal {

/// An axis of a chart with its ends, which hold all finite points; those of a logarithmic axis are
/// whole powers of ten.
class ChartRuler {
public:
    /// `coordinate`: 0 for x, 1 for y.      [setup]
    ChartRuler(std::span<const ChartSeries> series, const ChartAxis& axis, std::size_t coordinate);

    bool is_empty() const noexcept; ///< there is no finite point                         [any]

    /// Where a value lies between the ends, in [0, 1].                                  [any]
    double share(double value) const noexcept;

    /// Round values between the ends to draw a line at, about `most` of them, > 0.       [setup]
    std::vector<double> ticks(double most) const;

    /// A tick for eyes: 0.001, 10000, 10 with a raised exponent beyond.                  [setup]
    std::string label(double tick) const;

private:
    double scaled(double value) const noexcept;

    ChartAxis axis_;
    double low_;
    double high_;
};

} // namespace palpate::internal
