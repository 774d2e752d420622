// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/internal/time_chart.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include <palpate/engine/picture/internal/force_colors.h>
#include <palpate/engine/report/internal/chart_frame.h>
#include <palpate/engine/report/internal/html.h>

namespace palpate::internal {
namespace {

/// Where the curve is, pixels.
struct Plot {
    explicit Plot(ChartWidth chart) : width(width_px(chart) - kLeft - 14.0) {}
    static constexpr double kLeft = 46.0;
    static constexpr double kTop = 24.0;
    static constexpr double kHeight = 140.0;
    double width;

    /// About one for each pixel of a phone and of a desk's screen.
    std::size_t columns() const { return static_cast<std::size_t>(width); }
};

/// Smallest and largest number of the frames in one column; empty when smallest > largest.
struct ValueRange {
    double smallest = 1.0;
    double largest = 0.0;
    double share = 0.0; ///< of the run's time until the middle of the column's frames
    bool empty() const noexcept { return smallest > largest; }
};

std::vector<ValueRange> ranges_of(const FrameQuantity& quantity,
                                  std::span<const FrameReport> frames, const Plot& plot) {
    const std::size_t columns = std::min(plot.columns(), frames.size());
    std::vector<ValueRange> ranges(columns);
    const double begin_s = frames.front().time_s;
    const double duration_s = frames.back().time_s - begin_s;
    for (std::size_t column = 0; column < columns; ++column) {
        ValueRange& range = ranges[column];
        // A column has its share of the frames, and stands where their time is: periods may lack.
        const std::size_t from = (column * frames.size() + columns - 1) / columns;
        const std::size_t to = ((column + 1) * frames.size() + columns - 1) / columns;
        for (std::size_t i = from; i < to; ++i) {
            const double value = quantity.of(frames[i]);
            if (!std::isfinite(value)) continue;
            const bool is_first = range.empty();
            range.smallest = is_first ? value : std::min(range.smallest, value);
            range.largest = is_first ? value : std::max(range.largest, value);
        }
        const double middle_s = 0.5 * (frames[from].time_s + frames[to - 1].time_s);
        range.share = duration_s > 0.0
                          ? std::clamp((middle_s - begin_s) / duration_s, 0.0, 1.0)
                          : (static_cast<double>(column) + 0.5) / static_cast<double>(columns);
    }
    return ranges;
}

/// A closed band from the largest numbers there to the smallest ones back; a new one after columns
/// without numbers.
std::string band(const std::vector<ValueRange>& ranges, double top, const Plot& plot) {
    const auto point = [&](std::size_t column, double value) {
        const double x = Plot::kLeft + plot.width * ranges[column].share;
        const double y = Plot::kTop + Plot::kHeight * (1.0 - std::clamp(value / top, 0.0, 1.0));
        return fmt::format("{:.1f} {:.1f} ", x, y);
    };
    std::string path;
    for (std::size_t first = 0; first < ranges.size();) {
        std::size_t end = first;
        while (end < ranges.size() && !ranges[end].empty())
            ++end;
        if (end > first) {
            path += "M";
            for (std::size_t i = first; i < end; ++i)
                path += point(i, ranges[i].largest);
            for (std::size_t i = end; i > first; --i)
                path += point(i - 1, ranges[i - 1].smallest);
            path += "Z";
        }
        first = end + 1;
    }
    return path;
}

std::string time_ticks(double duration_s, const Plot& plot) {
    if (!(duration_s > 0.0) || !std::isfinite(duration_s)) return {};
    constexpr double kTickRoom = 60.0;
    const double step = round_up(duration_s * kTickRoom / plot.width);
    std::string ticks;
    for (int i = 0; i * step <= duration_s * (1.0 + 1e-9); ++i) {
        const double x = Plot::kLeft + plot.width * i * step / duration_s;
        const double y = Plot::kTop + Plot::kHeight;
        ticks += fmt::format("<path class=\"grid\" d=\"M{:.1f} {:.1f}v4\"/>", x, y) +
                 chart_text(x, y + 18.0, "middle", {readable(i * step) + (i == 0 ? " s" : "")});
    }
    return ticks;
}

} // namespace

const FrameQuantity kForce{"Force", "Magnitude of the force on the hand", "N",
                           [](const FrameReport& frame) { return glm::length(frame.force); }};
const FrameQuantity kIndentation{
    "Indentation", "How far the soft surface that is pressed in farthest is pressed in", "mm",
    [](const FrameReport& frame) { return 1e3 * frame.indentation_m; }};
const FrameQuantity kStiffness{
    "Stiffness", "What the hand feels of that surface's stiffness", "N/mm",
    [](const FrameReport& frame) { return 1e-3 * frame.stiffness_n_per_m; }};

double largest_of(const FrameQuantity& quantity, std::span<const FrameReport> frames) noexcept {
    double largest = 0.0;
    for (const FrameReport& frame : frames) {
        const double value = quantity.of(frame);
        if (std::isfinite(value)) largest = std::max(largest, value);
    }
    return largest;
}

std::string chart_over_time(const FrameQuantity& quantity, std::span<const FrameReport> frames,
                            double top, std::string_view title, std::string_view id) {
    if (frames.empty()) return {};
    const double duration_s = frames.back().time_s - frames.front().time_s;
    const std::string description = fmt::format(
        "{} over {} s, from 0 to at most {} {}; each column shows the smallest and the largest of "
        "its frames.",
        quantity.what, readable(duration_s), readable(largest_of(quantity, frames)), quantity.unit);
    return chart_in_page(id, [&](ChartWidth width, const std::string& one) {
        const Plot plot(width);
        std::string svg =
            chart_opening(width, Plot::kTop + Plot::kHeight + 26.0, one,
                          fmt::format("{} over time: {}", quantity.name, title), description);
        for (const double share : {0.0, 0.5, 1.0})
            svg += chart_line(Plot::kLeft, Plot::kTop + Plot::kHeight * (1.0 - share), plot.width,
                              readable(share * top));
        svg += time_ticks(duration_s, plot) +
               chart_text(Plot::kLeft - 6.0, 12.0, "end", {std::string(quantity.unit)});
        return svg + "<path class=\"force\" d=\"" +
               band(ranges_of(quantity, frames, plot), top, plot) + "\"/>\n</svg>\n";
    });
}

} // namespace palpate::internal
