// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/internal/series_chart.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <palpate/engine/internal/force_colors.h>
#include <palpate/engine/internal/html.h>

namespace palpate::internal {
namespace {

// Pixels of the drawing before the page scales it.
constexpr double kWidth = 760.0;
constexpr double kHeight = 420.0;
constexpr double kLeft = 72.0;
constexpr double kTop = 40.0;
constexpr double kPlotWidth = 660.0;
constexpr double kPlotHeight = 320.0;
constexpr std::size_t kMostMarkers = 40; // of a series: more would touch
constexpr double kMarker = 4.5;          // half its size
constexpr std::size_t kKinds = 4;        // classes s0 .. s3 of the page's style
constexpr double kTicks = 6.0;           // of a linear axis, about
constexpr int kMostDecades = 8;          // with a label each; of more, every second or third

/// An axis with its ends: where a value lies between them, in [0, 1].
class Ruler {
public:
    Ruler(const SeriesChart& chart, const ChartAxis& axis, std::size_t coordinate) : axis_(axis) {
        low_ = std::numeric_limits<double>::infinity();
        high_ = -low_;
        for (const ChartSeries& series : chart.series)
            for (const auto& point : series.points) {
                if (!std::isfinite(point[0]) || !std::isfinite(point[1])) continue;
                low_ = std::min(low_, scaled(point[coordinate]));
                high_ = std::max(high_, scaled(point[coordinate]));
            }
        if (is_log()) {
            low_ = std::floor(low_);
            high_ = std::max(std::ceil(high_), low_ + 1.0);
        } else if (is_empty() || high_ == low_) {
            high_ = low_ + 1.0;
        }
    }

    bool is_empty() const { return !std::isfinite(low_); }
    double share(double value) const { return (scaled(value) - low_) / (high_ - low_); }

    /// The values to draw a line at.
    std::vector<double> ticks() const {
        const double span = high_ - low_;
        const double step = is_log() ? std::ceil(span / kMostDecades) : round_up(span / kTicks);
        std::vector<double> values;
        for (double at = std::ceil(low_ / step); at * step <= high_ + 1e-9 * span; ++at)
            values.push_back(is_log() ? std::pow(10.0, at * step) : at * step);
        return values;
    }
    std::string label(double tick) const {
        constexpr double plain = 1e4; // powers of ten beyond are shorter with an exponent
        if (is_log() && (tick > plain || tick * plain < 1.0)) return fmt::format("{:.0e}", tick);
        return fmt::format("{:.6g}", tick == 0.0 ? 0.0 : tick);
    }

private:
    bool is_log() const { return axis_.scale == ChartScale::logarithmic; }
    double scaled(double value) const {
        return is_log() ? std::log10(std::max(value, axis_.smallest)) : value;
    }

    const ChartAxis& axis_;
    double low_;
    double high_;
};

struct Paper {
    Ruler x, y;
    double left(double value) const { return kLeft + kPlotWidth * x.share(value); }
    double top(double value) const { return kTop + kPlotHeight * (1.0 - y.share(value)); }
};

std::string grid(const Paper& paper, const SeriesChart& chart) {
    std::string svg;
    for (const double tick : paper.x.ticks())
        svg += fmt::format("<path class=\"grid\" d=\"M{0:.1f} {1:.1f}v{2:.1f}\"/>"
                           "<text x=\"{0:.1f}\" y=\"{3:.1f}\" text-anchor=\"middle\">{4}</text>\n",
                           paper.left(tick), kTop, kPlotHeight, kTop + kPlotHeight + 18.0,
                           paper.x.label(tick));
    for (const double tick : paper.y.ticks())
        svg += fmt::format("<path class=\"grid\" d=\"M{0:.1f} {1:.1f}h{2:.1f}\"/>"
                           "<text x=\"{3:.1f}\" y=\"{4:.1f}\" text-anchor=\"end\">{5}</text>\n",
                           kLeft, paper.top(tick), kPlotWidth, kLeft - 6.0, paper.top(tick) + 4.0,
                           paper.y.label(tick));
    svg +=
        fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n",
                    kLeft + 0.5 * kPlotWidth, kTop + kPlotHeight + 38.0, escape_html(chart.x.name));
    return svg + fmt::format("<text x=\"{0:.1f}\" y=\"{1:.1f}\" text-anchor=\"middle\" "
                             "transform=\"rotate(-90 {0:.1f} {1:.1f})\">{2}</text>\n",
                             16.0, kTop + 0.5 * kPlotHeight, escape_html(chart.y.name));
}

/// A shape of its own for each series, so that no colour is needed to tell them apart.
std::string marker(double x, double y, std::size_t kind) {
    switch (kind % kKinds) {
    case 0:
        return fmt::format("M{:.1f} {:.1f}l{a} {a}m0-{a}l-{a} {a}", x - kMarker, y - kMarker,
                           fmt::arg("a", 2.0 * kMarker));
    case 1:
        return fmt::format("M{:.1f} {:.1f}h{a}v{a}h-{a}z", x - kMarker, y - kMarker,
                           fmt::arg("a", 2.0 * kMarker));
    case 2:
        return fmt::format("M{:.1f} {:.1f}l{b} {a}h-{a}z", x, y - kMarker,
                           fmt::arg("a", 2.0 * kMarker), fmt::arg("b", kMarker));
    default:
        return fmt::format("M{:.1f} {:.1f}l{b} {b}l-{b} {b}l-{b}-{b}z", x, y - kMarker,
                           fmt::arg("b", kMarker));
    }
}

std::string line(const ChartSeries& series, const Paper& paper, std::size_t kind) {
    const bool marked = series.points.size() <= kMostMarkers;
    std::string path;
    std::string markers;
    bool pen_down = false;
    for (const auto& [x, y] : series.points) {
        if (!std::isfinite(x) || !std::isfinite(y)) {
            pen_down = false;
            continue;
        }
        path += fmt::format("{}{:.1f} {:.1f} ", pen_down ? 'L' : 'M', paper.left(x), paper.top(y));
        pen_down = true;
        if (!marked) continue;
        markers += fmt::format("<path class=\"mark s{}\" d=\"{}\"><title>{}: {}, {}</title></path>",
                               kind % kKinds, marker(paper.left(x), paper.top(y), kind),
                               escape_html(series.name), readable(x), readable(y));
    }
    return fmt::format("<path class=\"line s{}\" d=\"{}\"/>\n{}\n", kind % kKinds, path, markers);
}

std::string legend(const SeriesChart& chart) {
    std::string svg;
    double x = kLeft;
    for (std::size_t i = 0; i < chart.series.size(); ++i) {
        constexpr double letter = 7.0; // about, of 12 px text
        svg += fmt::format("<path class=\"mark s{}\" d=\"{}\"/>"
                           "<text x=\"{:.1f}\" y=\"20\">{}</text>\n",
                           i % kKinds, marker(x + kMarker, 16.0, i), x + 16.0,
                           escape_html(chart.series[i].name));
        x += 36.0 + letter * static_cast<double>(chart.series[i].name.size());
    }
    return svg;
}

} // namespace

std::string series_chart(const SeriesChart& chart, std::string_view id) {
    const Paper paper{Ruler(chart, chart.x, 0), Ruler(chart, chart.y, 1)};
    if (paper.x.is_empty()) return {};
    std::string svg =
        fmt::format("<svg class=\"chart\" viewBox=\"0 0 {0:.0f} {1:.0f}\" role=\"img\" "
                    "aria-labelledby=\"{2}-title {2}-text\">\n<title id=\"{2}-title\">{3}</title>\n"
                    "<desc id=\"{2}-text\">{4} across, {5} upwards.</desc>\n",
                    kWidth, kHeight, id, escape_html(chart.title), escape_html(chart.x.name),
                    escape_html(chart.y.name));
    svg += legend(chart) + grid(paper, chart);
    // The first on top: it is the one with the fewest points.
    for (std::size_t i = chart.series.size(); i > 0; --i)
        svg += line(chart.series[i - 1], paper, i - 1);
    return svg + "</svg>\n";
}

} // namespace palpate::internal
