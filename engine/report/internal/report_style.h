// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <palpate/engine/report/internal/html.h>
#include <palpate/engine/report/internal/series_look.h>

namespace palpate::internal {

inline constexpr const char* kPageBegin = R"(<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<meta name="color-scheme" content="light dark">
<title>)";

inline constexpr const char* kPageStyle = R"(</title>
<style>
)";

/// What follows the colours.
inline constexpr const char* kPageRules = R"(
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink); font: 16px/1.5 system-ui, sans-serif; }
main { max-width: 82rem; margin: 0 auto; padding: 1rem; }
h1 { font-size: 1.8rem; margin: .5rem 0 1rem; }
h2 { font-size: 1.35rem; margin: 2.5rem 0 .5rem; }
h3 { font-size: 1rem; margin: 1.5rem 0 .25rem; }
p, dl { max-width: 46rem; }
.scroll { overflow-x: auto; margin: 1rem 0; container-type: inline-size; }
.scroll:focus-visible { outline: 2px solid var(--accent); }
table { border-collapse: collapse; font-size: .875rem; font-variant-numeric: tabular-nums; }
caption { text-align: left; font-weight: 600; padding: .25rem 0; }
th, td { padding: .35rem .5rem; border-bottom: 1px solid var(--line); text-align: left; vertical-align: top; }
thead th { background: var(--band); vertical-align: bottom; font-weight: 600; }
thead .g { text-align: center; border-left: 1px solid var(--line); }
caption span { display: inline-block; max-width: 100cqi; position: sticky; left: 0; }
tbody th { font-weight: 600; min-width: 8rem; position: sticky; left: 0; background: var(--paper); overflow-wrap: break-word; }
.n { text-align: right; }
td.n { white-space: nowrap; }
dt { font-weight: 600; }
dd { margin: 0 0 .5rem; color: var(--soft); }
.pictures { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 20rem), 1fr)); gap: 1rem; }
figure { margin: 0; }
img { display: block; width: 100%; height: auto; border: 1px solid var(--line); border-radius: 6px; }
a { color: var(--accent); }
figcaption { color: var(--soft); font-size: .875rem; padding: .25rem 0; }
svg { display: block; width: 100%; height: auto; }
.legend { max-width: 28rem; margin-top: .5rem; }
.free { stroke: #7a808a; stroke-width: 1.5; }
.chart { max-width: 52rem; container-type: inline-size; }
.chart .narrow { display: none; }
@container (max-width: 619px) { .chart .wide { display: none; } .chart .narrow { display: block; max-width: 440px; } }
.beside { display: grid; grid-template-columns: minmax(0, 8fr) minmax(0, 5fr); gap: 1rem; align-items: start; }
.beside .chart { position: sticky; top: 1rem; }
.beside .scroll { margin: 0; }
.force { fill: var(--accent); stroke: var(--accent); stroke-width: .8; stroke-linejoin: round; }
footer { margin-top: 3rem; color: var(--soft); font-size: .875rem; }
@media (max-width: 60rem) { .beside { grid-template-columns: minmax(0, 1fr); } .beside .chart { position: static; } }
@media (max-width: 40rem) { tbody th { min-width: 6.5rem; max-width: 9rem; } }
@page { margin: 1cm; }
@page many { size: landscape; margin: 1cm; }
@media print {
  main { max-width: none; padding: 0; }
  .scroll { overflow: visible; }
  .beside { display: block; }
  .beside .chart, tbody th { position: static; }
  table { font-size: 6.5pt; }
  th, td { padding: .1rem .13rem; }
  tbody th { min-width: 0; }
  .many { page: many; }
  thead { display: table-header-group; }
  figure, tr, dl div, svg { break-inside: avoid; }
  h2, h3, caption, thead { break-after: avoid; }
}
</style>
</head>
<body>
<main>
)";

/// The beginning of a report page up to <main>; the title is plain text. Nothing is loaded from
/// anywhere and no script may run.                                                       [any]
inline std::string page_head(std::string_view title) {
    const std::string light = ":root { " + palette_css(kLightPalette) + " }\n";
    const std::string dark = ":root { " + palette_css(kDarkPalette) + " }\n";
    return kPageBegin + escape_html(title) + kPageStyle + light +
           "@media screen and (prefers-color-scheme: dark) {\n" + dark + "}\n" + chart_css() +
           kPageRules;
}

} // namespace palpate::internal
