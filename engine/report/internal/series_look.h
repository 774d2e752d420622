// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>

namespace palpate::internal {

/// Colours of a page as the style sheet writes them, light and dark.
struct PagePalette {
    std::string_view paper; ///< background
    std::string_view ink;   ///< text
    std::string_view soft;  ///< text that matters less
    std::string_view band;  ///< background of headings of tables
    std::string_view accent;
    std::string_view line; ///< of grids and tables
    /// Of the series 0 .. 7 of a chart, and again from 8 on; see SeriesLook.
    std::array<std::string_view, 8> series;
};

/// Each series has 3 : 1 against the paper (WCAG 2.1, 1.4.11), each text 4.5 : 1 (1.4.3). Any two
/// series differ for the eyes of a protanope, deuteranope and tritanope too, by 1.5 times of what
/// half of the viewers see in a marker (the test has the models).
inline constexpr PagePalette kLightPalette{
    "#fff",
    "#1c2126",
    "#57606a",
    "#f3f5f8",
    "#5b34b0",
    "#d0d7de",
    {"#1c2126", "#5b34b0", "#dc720c", "#00a184", "#3373c8", "#af1f66", "#666600", "#838ebb"}};
inline constexpr PagePalette kDarkPalette{
    "#14181d",
    "#e6e9ed",
    "#a0aab5",
    "#1d232a",
    "#b39cff",
    "#39424d",
    {"#e6e9ed", "#976df3", "#fca25b", "#0fa57e", "#6db6ff", "#ff74b4", "#eee15a", "#687380"}};

/// How a series is told apart without its colour: the shape of its markers, whether they are
/// filled, and the dashes of its line. No two of 16 looks are equal; from there on they repeat.
struct SeriesLook {
    std::size_t color = 0;   ///< of the palette's series
    std::size_t shape = 0;   ///< of marker_path()
    bool filled = false;     ///< the marker
    std::string_view dashes; ///< SVG's stroke-dasharray; empty: none
};

SeriesLook look_of(std::size_t series) noexcept; ///< [any]

/// Half the size of a marker, pixels.
inline constexpr double kMarker_px = 4.5;

/// SVG path data of the marker of a series with its centre at (x, y), pixels. [setup]
std::string marker_path(double x, double y, std::size_t shape);

/// The CSS of charts: text, grid, and the classes s0 .. s15 of the series' looks. Colours are the
/// variables --paper, --ink, --line and --s0 .. --s7. [setup]
std::string chart_css();

/// A palette as CSS variables, to stand in :root { }. [setup]
std::string palette_css(const PagePalette& palette);

} // namespace palpate::internal
