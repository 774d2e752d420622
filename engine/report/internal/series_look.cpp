// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/internal/series_look.h>

#include <fmt/format.h>

#include <palpate/engine/report/internal/chart_frame.h>

namespace palpate::internal {
namespace {

constexpr std::size_t kShapes = 8;
constexpr std::size_t kLooks = 2 * kShapes;
// Dashes are at most 9 px long, so that the 30 px of a legend show a whole period.
constexpr std::array<std::string_view, 4> kDashes{"", "8 4", "2.5 3", "9 3 2.5 3"};

} // namespace

SeriesLook look_of(std::size_t series) noexcept {
    const std::size_t look = series % kLooks;
    // The second round of the same shapes has the dashes moved on by one.
    return {look % kShapes, look % kShapes, look >= kShapes,
            kDashes[(look + look / kShapes) % kDashes.size()]};
}

std::string marker_path(double x, double y, std::size_t shape) {
    const double a = kMarker_px;
    const auto path = [&](std::string_view format) {
        return fmt::format(fmt::runtime(format), fmt::arg("l", x - a), fmt::arg("r", x + a),
                           fmt::arg("t", y - a), fmt::arg("b", y + a), fmt::arg("x", x),
                           fmt::arg("y", y), fmt::arg("a", a), fmt::arg("d", 2.0 * a));
    };
    switch (shape % kShapes) {
    case 0: // a circle
        return path("M{l:.1f} {y:.1f}a{a} {a} 0 1 0 {d} 0a{a} {a} 0 1 0-{d} 0z");
    case 1: // a square
        return path("M{l:.1f} {t:.1f}h{d}v{d}h-{d}z");
    case 2: // a triangle
        return path("M{x:.1f} {t:.1f}l{a} {d}h-{d}z");
    case 3: // a diamond
        return path("M{x:.1f} {t:.1f}l{a} {a}l-{a} {a}l-{a}-{a}z");
    case 4: // a triangle upside down
        return path("M{x:.1f} {b:.1f}l{a}-{d}h-{d}z");
    case 5: // an hourglass
        return path("M{l:.1f} {t:.1f}h{d}l-{d} {d}h{d}z");
    case 6: // a Greek cross
        return path("M{l:.1f} {y:.1f}m0-1.5h3v-3h3v3h3v3h-3v3h-3v-3h-3z");
    default: // a bow tie
        return path("M{l:.1f} {t:.1f}v{d}l{d}-{d}v{d}z");
    }
}

std::string palette_css(const PagePalette& palette) {
    std::string css = fmt::format(
        "--paper: {}; --ink: {}; --soft: {}; --line: {}; --band: {}; --accent: {};\n ",
        palette.paper, palette.ink, palette.soft, palette.line, palette.band, palette.accent);
    for (std::size_t i = 0; i < palette.series.size(); ++i)
        css += fmt::format(" --s{}: {};", i, palette.series[i]);
    return css;
}

std::string chart_css() {
    std::string css = fmt::format(
        "svg text {{ fill: var(--ink); font: {0:.0f}px/1 system-ui, sans-serif; }}\n"
        "svg .label {{ paint-order: stroke; stroke: var(--paper); stroke-width: 3px; }}\n"
        ".grid {{ stroke: var(--line); fill: none; }}\n"
        ".leader {{ stroke: var(--soft); fill: none; stroke-width: .8; }}\n"
        ".line {{ fill: none; stroke-width: 1.8; stroke-linejoin: round; }}\n"
        ".mark {{ fill: var(--paper); stroke-width: 1.8; }}\n"
        ".front {{ fill: none; stroke: var(--soft); stroke-width: 1.2; }}\n",
        kChartText_px);
    for (std::size_t i = 0; i < kLooks; ++i) {
        const SeriesLook look = look_of(i);
        css += fmt::format(".s{0} {{ stroke: var(--s{1}); }}", i, look.color);
        if (!look.dashes.empty())
            css += fmt::format(" .line.s{} {{ stroke-dasharray: {}; }}", i, look.dashes);
        if (look.filled) css += fmt::format(" .mark.s{} {{ fill: var(--s{}); }}", i, look.color);
        css += "\n";
    }
    return css;
}

} // namespace palpate::internal
