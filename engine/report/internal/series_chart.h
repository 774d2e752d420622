// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace palpate::internal {

/// Points (x, y) that belong together; NaN breaks the line.
struct ChartSeries {
    std::string name;
    std::vector<std::array<double, 2>> points;
    std::vector<std::string> labels; ///< one per point, written beside it: then the points are
                                     ///< things of their own that no line joins; or empty
};

/// How numbers are laid out along an axis.
enum class ChartScale { linear, logarithmic };

struct ChartAxis {
    std::string name; ///< with its unit
    ChartScale scale = ChartScale::linear;
    double smallest = 0.0; ///< logarithmic, > 0: smaller values are drawn here
};

/// Lines with a marker at each point, unless there are too many to tell apart; up to six series
/// keep their colours and shapes apart.
struct SeriesChart {
    std::string title;
    ChartAxis x;
    ChartAxis y;
    std::vector<ChartSeries> series;
};

/// The chart as an SVG element for a report page; `id` must be unique in it. Empty where there is
/// no finite point.   [setup]
std::string series_chart(const SeriesChart& chart, std::string_view id);

} // namespace palpate::internal
