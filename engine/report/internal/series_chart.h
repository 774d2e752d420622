// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <palpate/engine/report/internal/chart_frame.h>

namespace palpate::internal {

/// How a series' points are drawn.
enum class SeriesForm {
    automatic, ///< as points where they have labels, else as a line
    line,      ///< joined, in the order they are given
    points,    ///< markers alone: things of their own
};

/// Points (x, y) that belong together; NaN breaks the line.
struct ChartSeries {
    std::string name;                          ///< in the legend
    std::vector<std::array<double, 2>> points; ///< in the axes' units
    /// One per point, written beside it, "" for none; or no labels at all. A label for which there
    /// is no room is left out; the marker's tooltip has it still.
    std::vector<std::string> labels;
    SeriesForm form = SeriesForm::automatic; ///< line or points
    /// Which of the 16 looks (colour, marker, dashes) it has; by default its place in the chart.
    /// To be given where several charts show the same things. See look_of().
    std::optional<std::size_t> look = std::nullopt;
};

/// How numbers are laid out along an axis.
enum class ChartScale { linear, logarithmic };

struct ChartAxis {
    std::string name;                      ///< with its unit
    ChartScale scale = ChartScale::linear; ///< see there
    double smallest = 0.0;                 ///< logarithmic, > 0: smaller values are drawn here
};

/// Lines with markers, and points with labels. Each of up to 16 series is told apart by its marker
/// and its dashes, the first eight by their colour too. Where there are too many points to mark
/// each, eight of a line are marked.
struct SeriesChart {
    std::string title; ///< for screen readers
    ChartAxis x;       ///< to the right
    ChartAxis y;       ///< upwards
    std::vector<ChartSeries> series;
    /// The legend's name of a line of steps along pareto_front(series); empty: no such line.
    std::string front = {};
};

/// The points that no other point of all series is better than: smaller in one coordinate and not
/// larger in the other. By growing x; each once; only finite ones.   [setup]
std::vector<std::array<double, 2>> pareto_front(std::span<const ChartSeries> series);

/// The chart for a report page, once for wide screens and paper and once for phones; `id` must be
/// unique in the page. Empty where there is no finite point.   [setup]
std::string series_chart(const SeriesChart& chart, std::string_view id);

/// Charts one below the other as an SVG file of their own, with colours for light and dark. Shown
/// on a page that is 390 px wide its text is at least 11 px high if it is `narrow`. Charts without
/// a finite point are left out. [setup]
std::string series_picture(std::span<const SeriesChart> charts, ChartWidth width);

} // namespace palpate::internal
