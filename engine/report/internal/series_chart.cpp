// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/internal/series_chart.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <palpate/engine/report/internal/chart_ruler.h>
#include <palpate/engine/report/internal/html.h>
#include <palpate/engine/report/internal/label_places.h>
#include <palpate/engine/report/internal/series_look.h>

namespace palpate::internal {
namespace {

constexpr double kMarkerRoom_px = 16.0;   // of the plot's width for each marker, else they touch
constexpr std::size_t kMarkersOfMany = 8; // of a line with more points than there is room for
constexpr double kTickRoom_px = 30.0;     // from one line across to the next, at least
constexpr double kTickGap_px = 12.0;      // between labels of the axis below
constexpr double kSample_px = 32.0;       // of a line, in the legend
constexpr double kAbovePlot_px = 12.0;    // for labels of points at its upper edge
constexpr double kMostSegments = 200;     // of a line that labels are kept off

/// What is where, pixels.
struct Paper {
    ChartRuler x, y;
    ChartWidth width;
    Patch plot{};
    double height = 0.0; ///< of all
    std::vector<double> x_ticks{};
    std::vector<double> y_ticks{};

    double left(double value) const {
        return plot.left + (plot.right - plot.left) * x.share(value);
    }
    double top(double value) const {
        return plot.bottom - (plot.bottom - plot.top) * y.share(value);
    }
};

bool is_finite(const std::array<double, 2>& point) {
    return std::isfinite(point[0]) && std::isfinite(point[1]);
}

bool is_joined(const ChartSeries& series) {
    if (series.form == SeriesForm::automatic) return series.labels.empty();
    return series.form == SeriesForm::line;
}

std::size_t look(const SeriesChart& chart, std::size_t series) {
    return chart.series[series].look.value_or(series) % 16;
}

/// What stands above the plot: a line and a marker as the series has them, and its name.
struct Legend {
    std::string svg;
    double height = 0.0;
};

Legend legend(const SeriesChart& chart, double width) {
    constexpr double gap = 6.0, between = 16.0, row = 20.0;
    double x = 2.0;
    double y = 12.0;
    std::string svg;
    const auto key = [&](const std::string& name, const std::string& attributes, double sample,
                         const auto& drawn) {
        const double long_px = sample + gap + text_width_px(name);
        if (x > 2.0 && x + long_px > width) {
            x = 2.0;
            y += row;
        }
        svg += fmt::format("<g class=\"key\"{}>{}", attributes, drawn()) +
               chart_text(x + sample + gap, y + 4.5, "start", {name}) + "</g>\n";
        x += long_px + between;
    };
    for (std::size_t i = 0; i < chart.series.size(); ++i) {
        const bool joined = is_joined(chart.series[i]);
        const double sample = joined ? kSample_px : 2.0 * kMarker_px;
        key(chart.series[i].name, fmt::format(" data-series=\"{}\"", i), sample, [&] {
            const std::size_t kind = look(chart, i);
            std::string path;
            if (joined)
                path = fmt::format("<path class=\"line s{}\" d=\"M{:.1f} {:.1f}h{}\"/>", kind, x, y,
                                   kSample_px);
            return path + fmt::format("<path class=\"mark s{}\" d=\"{}\"/>", kind,
                                      marker_path(x + 0.5 * sample, y, look_of(kind).shape));
        });
    }
    if (!chart.front.empty())
        key(chart.front, "", kSample_px, [&] {
            return fmt::format("<path class=\"front\" d=\"M{:.1f} {:.1f}h16v8h16\"/>", x, y - 4.0);
        });
    return {svg, y + 12.0};
}

/// As many ticks of the axis below as their labels leave room for.
std::vector<double> ticks_below(const ChartRuler& ruler, double width) {
    std::vector<double> ticks;
    for (double most = std::floor(width / kTickRoom_px); most >= 1.0; --most) {
        ticks = ruler.ticks(most);
        bool fits = true;
        for (std::size_t i = 1; i < ticks.size(); ++i)
            fits = fits && (ruler.share(ticks[i]) - ruler.share(ticks[i - 1])) * width >
                               0.5 * (text_width_px(ruler.label(ticks[i])) +
                                      text_width_px(ruler.label(ticks[i - 1]))) +
                                   kTickGap_px;
        if (fits) break;
    }
    return ticks;
}

/// Lays the chart out below a legend of this height.
Paper paper_of(const SeriesChart& chart, ChartWidth width, double legend_px) {
    Paper paper{ChartRuler(chart.series, chart.x, 0), ChartRuler(chart.series, chart.y, 1), width};
    const double plot_height = width == ChartWidth::wide ? 310.0 : 250.0;
    const double names =
        kChartLine_px * static_cast<double>(lines_of(chart.y.name, width_px(width)).size());
    paper.y_ticks = paper.y.ticks(plot_height / kTickRoom_px);
    double widest = 0.0;
    for (const double tick : paper.y_ticks)
        widest = std::max(widest, text_width_px(paper.y.label(tick)));
    paper.plot.left = widest + 10.0;
    paper.plot.right = width_px(width) - 8.0;
    paper.x_ticks = ticks_below(paper.x, paper.plot.right - paper.plot.left);
    if (!paper.x_ticks.empty()) // the last one's label is centred below it
        paper.plot.right = std::min(paper.plot.right,
                                    width_px(width) - 2.0 -
                                        0.5 * text_width_px(paper.x.label(paper.x_ticks.back())));
    paper.plot.top = legend_px + names + kAbovePlot_px + 2.0;
    paper.plot.bottom = paper.plot.top + plot_height;
    paper.height =
        paper.plot.bottom + 22.0 + 4.0 +
        kChartLine_px * static_cast<double>(lines_of(chart.x.name, width_px(width)).size());
    return paper;
}

std::string grid(const Paper& paper, const SeriesChart& chart) {
    const Patch& plot = paper.plot;
    std::string svg;
    for (const double tick : paper.x_ticks)
        svg += fmt::format("<path class=\"grid\" d=\"M{:.1f} {:.1f}v{:.1f}\"/>", paper.left(tick),
                           plot.top, plot.bottom - plot.top) +
               chart_text(paper.left(tick), plot.bottom + 18.0, "middle", {paper.x.label(tick)});
    for (const double tick : paper.y_ticks)
        svg += chart_line(plot.left, paper.top(tick), plot.right - plot.left, paper.y.label(tick));
    const std::vector<std::string> x_name = lines_of(chart.x.name, width_px(paper.width));
    const std::vector<std::string> y_name = lines_of(chart.y.name, width_px(paper.width));
    const double above = kChartLine_px * static_cast<double>(y_name.size());
    return svg + chart_text(0.5 * width_px(paper.width), plot.bottom + 37.0, "middle", x_name) +
           chart_text(2.0, plot.top - kAbovePlot_px - above + kChartText_px, "start", y_name);
}

/// The points of a series that get a marker: all, or eight of a line that has more than there is
/// room for, not at the same places as those of the next series.
std::vector<std::size_t> marked(const SeriesChart& chart, std::size_t series, const Paper& paper) {
    const ChartSeries& one = chart.series[series];
    const double width = paper.plot.right - paper.plot.left;
    const bool all =
        !is_joined(one) || static_cast<double>(one.points.size()) * kMarkerRoom_px <= width;
    std::vector<std::size_t> indices;
    if (all) {
        for (std::size_t i = 0; i < one.points.size(); ++i)
            if (is_finite(one.points[i])) indices.push_back(i);
        return indices;
    }
    const double offset =
        (static_cast<double>(series) + 0.5) / static_cast<double>(chart.series.size());
    for (std::size_t k = 0; k < kMarkersOfMany; ++k) {
        const double wanted =
            (static_cast<double>(k) + offset) / static_cast<double>(kMarkersOfMany);
        std::size_t best = one.points.size();
        double off = 0.5 / static_cast<double>(kMarkersOfMany);
        for (std::size_t i = 0; i < one.points.size(); ++i) {
            if (!is_finite(one.points[i])) continue;
            const double distance = std::abs(paper.x.share(one.points[i][0]) - wanted);
            if (distance >= off) continue;
            off = distance;
            best = i;
        }
        if (best < one.points.size()) indices.push_back(best);
    }
    return indices;
}

std::string drawn(const SeriesChart& chart, std::size_t series, const Paper& paper) {
    const ChartSeries& one = chart.series[series];
    const std::size_t kind = look(chart, series);
    std::string svg = fmt::format("<g class=\"series\" data-series=\"{}\">", series);
    if (is_joined(one)) {
        svg += fmt::format("<path class=\"line s{}\" d=\"", kind);
        const auto is_there = [&](std::size_t i) {
            return i < one.points.size() && is_finite(one.points[i]);
        };
        for (std::size_t i = 0; i < one.points.size(); ++i) {
            if (!is_there(i)) continue;
            const bool goes_on = i > 0 && is_there(i - 1);
            svg += fmt::format("{}{:.1f} {:.1f} ", goes_on ? 'L' : 'M',
                               paper.left(one.points[i][0]), paper.top(one.points[i][1]));
            if (!goes_on && !is_there(i + 1)) svg += "h1 "; // else nothing would be seen of it
        }
        svg += "\"/>\n";
    }
    for (const std::size_t i : marked(chart, series, paper)) {
        const auto& [x, y] = one.points[i];
        const bool named = i < one.labels.size() && !one.labels[i].empty();
        svg += fmt::format("<path class=\"mark s{}\" d=\"{}\"><title>{}: {}, {}</title></path>",
                           kind, marker_path(paper.left(x), paper.top(y), look_of(kind).shape),
                           escape_html(named ? one.labels[i] : one.name), readable(x), readable(y));
    }
    return svg + "</g>\n";
}

/// Keeps labels off all that is drawn.
LabelPlaces places_of(const SeriesChart& chart, const Paper& paper) {
    LabelPlaces places(
        {paper.plot.left, paper.plot.top - kAbovePlot_px, paper.plot.right, paper.plot.bottom});
    for (std::size_t s = 0; s < chart.series.size(); ++s) {
        const auto& points = chart.series[s].points;
        for (const std::size_t i : marked(chart, s, paper)) {
            const double x = paper.left(points[i][0]);
            const double y = paper.top(points[i][1]);
            const double half = kMarker_px + 1.0;
            places.keep_off({x - half, y - half, x + half, y + half});
        }
        if (!is_joined(chart.series[s]) || static_cast<double>(points.size()) > kMostSegments)
            continue;
        for (std::size_t i = 1; i < points.size(); ++i)
            if (is_finite(points[i - 1]) && is_finite(points[i]))
                places.avoid({{{paper.left(points[i - 1][0]), paper.top(points[i - 1][1])},
                               {paper.left(points[i][0]), paper.top(points[i][1])}}});
    }
    return places;
}

std::string labels(const SeriesChart& chart, const Paper& paper) {
    constexpr double height = kChartText_px + 2.0;
    constexpr double below = 4.0; // the baseline
    std::vector<std::string> names;
    std::vector<LabelWish> wishes;
    for (const ChartSeries& series : chart.series)
        for (std::size_t i = 0; i < std::min(series.labels.size(), series.points.size()); ++i) {
            const auto& [x, y] = series.points[i];
            if (series.labels[i].empty() || !is_finite(series.points[i])) continue;
            names.push_back(series.labels[i]);
            wishes.push_back({paper.left(x), paper.top(y), text_width_px(names.back()), height});
        }
    const std::vector<std::optional<LabelPlace>> places = places_of(chart, paper).place(wishes);
    std::string leaders;
    std::string texts;
    for (std::size_t i = 0; i < names.size(); ++i) {
        if (!places[i]) continue;
        const auto& [patch, leader] = *places[i];
        if (leader)
            leaders +=
                fmt::format("<path class=\"leader\" d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}\"/>\n",
                            (*leader)[0][0], (*leader)[0][1], (*leader)[1][0], (*leader)[1][1]);
        texts += fmt::format("<text class=\"label\" text-anchor=\"middle\" x=\"{:.1f}\" "
                             "y=\"{:.1f}\">{}</text>\n",
                             0.5 * (patch.left + patch.right), patch.bottom - below,
                             escape_html(names[i]));
    }
    return leaders + texts;
}

/// Steps: the least y that is known for at most this x. To the edges of the plot.
std::string front(const SeriesChart& chart, const Paper& paper) {
    if (chart.front.empty()) return {};
    const std::vector<std::array<double, 2>> best = pareto_front(chart.series);
    std::string path = fmt::format("M{:.1f} {:.1f}", paper.left(best.front()[0]), paper.plot.top);
    for (const auto& [x, y] : best)
        path += fmt::format("H{:.1f}V{:.1f}", paper.left(x), paper.top(y));
    return fmt::format("<path class=\"front\" d=\"{}H{:.1f}\"/>\n", path, paper.plot.right);
}

std::string drawing(const SeriesChart& chart, ChartWidth width, std::string_view id) {
    const Legend above = legend(chart, width_px(width));
    const Paper paper = paper_of(chart, width, above.height);
    std::string svg =
        chart_opening(width, paper.height, id, chart.title,
                      fmt::format("{} across, {} upwards.", chart.x.name, chart.y.name));
    svg += above.svg + grid(paper, chart) + front(chart, paper);
    // The first on top: it is the one with the fewest points.
    for (std::size_t i = chart.series.size(); i > 0; --i)
        svg += drawn(chart, i - 1, paper);
    return svg + labels(chart, paper) + "</svg>\n";
}

bool has_points(const SeriesChart& chart) {
    return !ChartRuler(chart.series, chart.x, 0).is_empty();
}

} // namespace

std::vector<std::array<double, 2>> pareto_front(std::span<const ChartSeries> series) {
    std::vector<std::array<double, 2>> points;
    for (const ChartSeries& one : series)
        std::copy_if(one.points.begin(), one.points.end(), std::back_inserter(points), is_finite);
    std::sort(points.begin(), points.end()); // by x, then y
    std::vector<std::array<double, 2>> best;
    double least = std::numeric_limits<double>::infinity();
    for (const auto& point : points) {
        if (point[1] >= least) continue; // an earlier one is as good in x, and not worse in y
        least = point[1];
        best.push_back(point);
    }
    return best;
}

std::string series_chart(const SeriesChart& chart, std::string_view id) {
    if (!has_points(chart)) return {};
    return chart_in_page(
        id, [&](ChartWidth width, const std::string& one) { return drawing(chart, width, one); });
}

std::string series_picture(std::span<const SeriesChart> charts, ChartWidth width) {
    constexpr double shown = 544.0; // of a narrow one, where the page has room
    constexpr double margin = 12.0;
    std::string body;
    double height = margin;
    for (std::size_t i = 0; i < charts.size(); ++i) {
        if (!has_points(charts[i])) continue;
        const Legend above = legend(charts[i], width_px(width));
        const double own = paper_of(charts[i], width, above.height).height;
        body += fmt::format(
            "<svg x=\"{}\" y=\"{:.0f}\" width=\"{:.0f}\" height=\"{:.0f}\">\n{}</svg>\n", margin,
            height, width_px(width), own, drawing(charts[i], width, fmt::format("chart{}", i)));
        height += own + margin;
    }
    const double all = width_px(width) + 2.0 * margin;
    const double scale = width == ChartWidth::narrow ? shown / all : 1.0;
    return fmt::format("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" "
                       "width=\"{2:.0f}\" height=\"{3:.0f}\">\n<style>\n:root {{ {4} }}\n"
                       "@media (prefers-color-scheme: dark) {{ :root {{ {5} }} }}\n{6}"
                       "#paper {{ fill: var(--paper); }}\n</style>\n"
                       "<rect id=\"paper\" width=\"100%\" height=\"100%\"/>\n{7}</svg>\n",
                       all, height, scale * all, scale * height, palette_css(kLightPalette),
                       palette_css(kDarkPalette), chart_css(), body);
}

} // namespace palpate::internal
