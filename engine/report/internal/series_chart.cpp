// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/internal/series_chart.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <palpate/engine/picture/internal/force_colors.h>
#include <palpate/engine/report/internal/html.h>

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
constexpr std::size_t kKinds = 6;        // classes s0 .. s5 of the page's style
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
        svg += chart_line(kLeft, paper.top(tick), kPlotWidth, paper.y.label(tick));
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
    case 3:
        return fmt::format("M{:.1f} {:.1f}l{b} {b}l-{b} {b}l-{b}-{b}z", x, y - kMarker,
                           fmt::arg("b", kMarker));
    case 4:
        return fmt::format("M{:.1f} {:.1f}a{b} {b} 0 1 0 {a} 0a{b} {b} 0 1 0-{a} 0z", x - kMarker,
                           y, fmt::arg("a", 2.0 * kMarker), fmt::arg("b", kMarker));
    default:
        return fmt::format("M{:.1f} {:.1f}l{b}-{a}h-{a}z", x, y + kMarker,
                           fmt::arg("a", 2.0 * kMarker), fmt::arg("b", kMarker));
    }
}

std::string line(const ChartSeries& series, const Paper& paper, std::size_t kind) {
    const bool joined = series.labels.empty();
    const bool marked = !joined || series.points.size() <= kMostMarkers;
    std::string path;
    std::string markers;
    bool pen_down = false;
    for (std::size_t i = 0; i < series.points.size(); ++i) {
        const auto& [x, y] = series.points[i];
        if (!std::isfinite(x) || !std::isfinite(y)) {
            pen_down = false;
            continue;
        }
        path += fmt::format("{}{:.1f} {:.1f} ", pen_down ? 'L' : 'M', paper.left(x), paper.top(y));
        pen_down = true;
        if (!marked) continue;
        markers += fmt::format("<path class=\"mark s{}\" d=\"{}\"><title>{}: {}, {}</title></path>",
                               kind % kKinds, marker(paper.left(x), paper.top(y), kind),
                               escape_html(joined ? series.name : series.labels[i]), readable(x),
                               readable(y));
    }
    if (!joined) return markers + "\n";
    return fmt::format("<path class=\"line s{}\" d=\"{}\"/>\n{}\n", kind % kKinds, path, markers);
}

/// A rectangle of the drawing, pixels.
struct Patch {
    double left, top, right, bottom;
    bool overlaps(const Patch& other) const {
        return left < other.right && other.left < right && top < other.bottom && other.top < bottom;
    }
};

/// Finds room for labels: beside, above or below their points, off every marker and other label.
class LabelPlaces {
public:
    LabelPlaces(const SeriesChart& chart, const Paper& paper) {
        for (const ChartSeries& series : chart.series) {
            if (series.labels.empty() && series.points.size() > kMostMarkers) continue;
            for (const auto& [x, y] : series.points)
                if (std::isfinite(x) && std::isfinite(y))
                    taken_.push_back(around(paper.left(x), paper.top(y)));
        }
    }

    /// The left end of a text's baseline.
    std::array<double, 2> place(double x, double y, std::size_t letters) {
        const double width = kLetter * static_cast<double>(letters);
        for (const double down : {4.0, -10.0, 18.0, -22.0, 30.0, -34.0, 42.0, -46.0})
            for (const double left : {x + kGap, x - kGap - width, x - 0.5 * width}) {
                const Patch patch{left, y + down - kAscent, left + width, y + down + kDescent};
                if (patch.left < kLeft || patch.right > kLeft + kPlotWidth || patch.top < kTop ||
                    patch.bottom > kTop + kPlotHeight)
                    continue;
                if (std::any_of(taken_.begin(), taken_.end(),
                                [&](const Patch& other) { return patch.overlaps(other); }))
                    continue;
                taken_.push_back(patch);
                return {left, y + down};
            }
        return {x + kGap, y}; // no room: over something else
    }

private:
    static constexpr double kLetter = 7.0; // about, of the 14 px text of a phone
    static constexpr double kAscent = 9.0;
    static constexpr double kDescent = 3.0;
    static constexpr double kGap = 8.0; // between a point and its label

    static Patch around(double x, double y) {
        return {x - kMarker, y - kMarker, x + kMarker, y + kMarker};
    }

    std::vector<Patch> taken_;
};

std::string labels(const SeriesChart& chart, const Paper& paper) {
    LabelPlaces places(chart, paper);
    std::string svg;
    for (const ChartSeries& series : chart.series)
        for (std::size_t i = 0; i < series.labels.size(); ++i) {
            const auto& [x, y] = series.points[i];
            if (!std::isfinite(x) || !std::isfinite(y)) continue;
            const auto [left, baseline] =
                places.place(paper.left(x), paper.top(y), series.labels[i].size());
            svg += fmt::format("<text class=\"label\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n", left,
                               baseline, escape_html(series.labels[i]));
        }
    return svg;
}

std::string legend(const SeriesChart& chart) {
    std::string svg;
    double x = kLeft;
    for (std::size_t i = 0; i < chart.series.size(); ++i) {
        constexpr double letter = 10.0; // about, of the 17 px text of a phone
        svg += fmt::format("<path class=\"mark s{}\" d=\"{}\"/>"
                           "<text x=\"{:.1f}\" y=\"20\">{}</text>\n",
                           i % kKinds, marker(x + kMarker, 16.0, i), x + 16.0,
                           escape_html(chart.series[i].name));
        x += 32.0 + letter * static_cast<double>(chart.series[i].name.size());
    }
    return svg;
}

} // namespace

std::string series_chart(const SeriesChart& chart, std::string_view id) {
    const Paper paper{Ruler(chart, chart.x, 0), Ruler(chart, chart.y, 1)};
    if (paper.x.is_empty()) return {};
    std::string svg =
        chart_opening(kWidth, kHeight, id, chart.title,
                      fmt::format("{} across, {} upwards.", chart.x.name, chart.y.name));
    svg += legend(chart) + grid(paper, chart);
    // The first on top: it is the one with the fewest points.
    for (std::size_t i = chart.series.size(); i > 0; --i)
        svg += line(chart.series[i - 1], paper, i - 1);
    return svg + labels(chart, paper) + "</svg>\n";
}

} // namespace palpate::internal
