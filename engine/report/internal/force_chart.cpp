// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/internal/force_chart.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include <palpate/engine/picture/internal/force_colors.h>
#include <palpate/engine/report/internal/html.h>

namespace palpate::internal {
namespace {

// Pixels of the drawing before the page scales it.
constexpr double kWidth = 660.0;
constexpr double kHeight = 190.0;
constexpr double kLeft = 46.0;
constexpr double kTop = 12.0;
constexpr double kPlotWidth = 600.0;
constexpr double kPlotHeight = 140.0;
constexpr std::size_t kColumns = 600;

/// Smallest and largest force of the frames in one column; empty when smallest > largest.
struct Range {
    double smallest = 1.0;
    double largest = 0.0;
    bool empty() const noexcept { return smallest > largest; }
};

std::vector<Range> ranges_of(std::span<const FrameReport> frames) {
    const std::size_t columns = std::min(kColumns, frames.size());
    std::vector<Range> ranges(columns);
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const double force = glm::length(frames[i].force);
        if (!std::isfinite(force)) continue;
        Range& range = ranges[i * columns / frames.size()];
        range = range.empty()
                    ? Range{force, force}
                    : Range{std::min(range.smallest, force), std::max(range.largest, force)};
    }
    return ranges;
}

/// A closed band from the largest forces there to the smallest ones back; a new one after columns
/// without numbers.
std::string band(const std::vector<Range>& ranges, double top_n) {
    const auto point = [&](std::size_t column, double force) {
        const double x = kLeft + kPlotWidth * (static_cast<double>(column) + 0.5) /
                                     static_cast<double>(ranges.size());
        const double y = kTop + kPlotHeight * (1.0 - std::clamp(force / top_n, 0.0, 1.0));
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

std::string time_ticks(double duration_s) {
    if (!(duration_s > 0.0) || !std::isfinite(duration_s)) return {};
    constexpr double kTicks = 6.0; // about as many
    const double step = round_up(duration_s / kTicks);
    std::string ticks;
    for (int i = 0; i * step <= duration_s * (1.0 + 1e-9); ++i) {
        const double x = kLeft + kPlotWidth * i * step / duration_s;
        ticks +=
            fmt::format("<path class=\"grid\" d=\"M{0:.1f} {1:.1f}v4\"/>"
                        "<text x=\"{0:.1f}\" y=\"{2:.1f}\" text-anchor=\"middle\">{3}{4}</text>\n",
                        x, kTop + kPlotHeight, kTop + kPlotHeight + 17.0, readable(i * step),
                        i == 0 ? " s" : "");
    }
    return ticks;
}

} // namespace

double largest_force_n(std::span<const FrameReport> frames) noexcept {
    double largest = 0.0;
    for (const FrameReport& frame : frames) {
        const double force = glm::length(frame.force);
        if (std::isfinite(force)) largest = std::max(largest, force);
    }
    return largest;
}

std::string force_chart(std::span<const FrameReport> frames, double top_n, std::string_view title,
                        std::string_view id) {
    if (frames.empty()) return {};
    const double duration_s = frames.back().time_s - frames.front().time_s;
    std::string svg = chart_opening(
        kWidth, kHeight, id, fmt::format("Force over time: {}", title),
        fmt::format("Magnitude of the force on the hand over {} s, from 0 to at most {} N; each "
                    "column shows the smallest and the largest of its frames.",
                    readable(duration_s), readable(largest_force_n(frames))));
    for (const double share : {0.0, 0.5, 1.0})
        svg += chart_line(kLeft, kTop + kPlotHeight * (1.0 - share), kPlotWidth,
                          readable(share * top_n));
    svg += time_ticks(duration_s);
    svg += fmt::format("<text x=\"10\" y=\"{:.0f}\">N</text>\n", kTop + 0.25 * kPlotHeight);
    svg += "<path class=\"force\" d=\"" + band(ranges_of(frames), top_n) + "\"/>\n";
    return svg + "</svg>\n";
}

} // namespace palpate::internal
