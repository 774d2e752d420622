// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace palpate::internal {

/// Each chart is drawn once for each of these, because text that is scaled down with its drawing
/// is too small on a phone. A page shows the one that fits (see chart_css()).
enum class ChartWidth { wide, narrow };

inline constexpr double kChartText_px = 13.0; ///< size of all text of a chart, in its own pixels

/// How wide the drawing is before the page scales it, pixels: 720, or 340 for a phone.   [any]
double width_px(ChartWidth width) noexcept;

/// Width of one line of UTF-8 in the charts' font, pixels: of DejaVu Sans, the widest of the usual
/// ones, so that there is room for the others too. An estimate by classes of letters. [any]
double text_width_px(std::string_view text) noexcept;

/// The words of a text on lines that are at most `width_px` long by the estimate above, where
/// words allow it.    [setup]
std::vector<std::string> lines_of(std::string_view text, double width_px);

/// Lines of text one below the other, `anchor` as SVG's text-anchor; the first one's baseline is
/// at (`x`, `y`), pixels. Escaped here.       [setup]
std::string chart_text(double x, double y, std::string_view anchor,
                       const std::vector<std::string>& lines);

/// From one baseline to the next, pixels.
inline constexpr double kChartLine_px = 17.0;

/// The beginning of a chart: an <svg> of the class `wide` or `narrow`, with its title and
/// description for screen readers, which are escaped here. `id` must be unique in the page.
/// [setup]
std::string chart_opening(ChartWidth width, double height_px, std::string_view id,
                          std::string_view title, std::string_view description);

/// A line across a chart from (`left`, `y`), `width` long, pixels, with its label at the left.
/// [setup]
std::string chart_line(double left, double y, double width, std::string_view label);

/// A chart in a page: what `draw` gives for both widths; each call gets an id of its own made of
/// `id`, which must be unique in the page. Empty where `draw` gives nothing. [setup]
std::string
chart_in_page(std::string_view id,
              const std::function<std::string(ChartWidth, const std::string& id)>& draw);

} // namespace palpate::internal
