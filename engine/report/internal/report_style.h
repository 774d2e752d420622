// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <palpate/engine/report/internal/html.h>

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
:root { --paper: #fff; --ink: #1c2126; --soft: #57606a; --line: #d0d7de; --band: #f3f5f8; --accent: #5b34b0;
  --s0: #1c2126; --s1: #5b34b0; --s2: #b34700; --s3: #00705a; --s4: #0b5cad; --s5: #a3246b; }
@media (prefers-color-scheme: dark) {
  :root { --paper: #14181d; --ink: #e6e9ed; --soft: #a0aab5; --line: #39424d; --band: #1d232a; --accent: #b39cff;
  --s0: #e6e9ed; --s1: #b39cff; --s2: #ff9d52; --s3: #4fd0b0; --s4: #6cb6ff; --s5: #ff8ec2; }
}
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink); font: 16px/1.5 system-ui, sans-serif; }
main { max-width: 82rem; margin: 0 auto; padding: 1rem; }
h1 { font-size: 1.8rem; margin: .5rem 0 1rem; }
h2 { font-size: 1.35rem; margin: 2.5rem 0 .5rem; }
h3 { font-size: 1rem; margin: 1.5rem 0 .25rem; }
p, dl { max-width: 46rem; }
.scroll { overflow-x: auto; margin: 1rem 0; }
.scroll:focus-visible { outline: 2px solid var(--accent); }
table { border-collapse: collapse; font-size: .875rem; font-variant-numeric: tabular-nums; }
caption { text-align: left; font-weight: 600; padding: .25rem 0; }
th, td { padding: .35rem .5rem; border-bottom: 1px solid var(--line); text-align: left; vertical-align: top; }
thead th { background: var(--band); vertical-align: bottom; font-weight: 600; }
thead .g { text-align: center; border-left: 1px solid var(--line); }
tbody th { font-weight: 600; min-width: 8rem; position: sticky; left: 0; background: var(--paper); }
.n { text-align: right; }
td.n { white-space: nowrap; }
dt { font-weight: 600; }
dd { margin: 0 0 .5rem; color: var(--soft); }
.pictures { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 20rem), 1fr)); gap: 1rem; }
figure { margin: 0; }
img { display: block; width: 100%; height: auto; border: 1px solid var(--line); border-radius: 6px; }
figcaption { color: var(--soft); font-size: .875rem; padding: .25rem 0; }
svg { display: block; width: 100%; height: auto; }
svg text { fill: var(--ink); font: 12px system-ui, sans-serif; }
.legend { max-width: 28rem; margin-top: .5rem; }
.free { stroke: #7a808a; stroke-width: 1.5; }
.chart { max-width: 58rem; }
.beside { display: grid; grid-template-columns: minmax(0, 8fr) minmax(0, 5fr); gap: 1rem; align-items: start; }
.beside .scroll { margin: 0; max-height: 34rem; overflow: auto; }
.grid { stroke: var(--line); fill: none; }
.force { fill: var(--accent); stroke: var(--accent); stroke-width: .8; stroke-linejoin: round; }
.s0 { stroke: var(--s0); } .s1 { stroke: var(--s1); } .s2 { stroke: var(--s2); } .s3 { stroke: var(--s3); }
.s4 { stroke: var(--s4); } .s5 { stroke: var(--s5); }
.line { fill: none; stroke-width: 1.5; stroke-linejoin: round; }
.mark { fill: var(--paper); stroke-width: 1.8; }
footer { margin-top: 3rem; color: var(--soft); font-size: .875rem; }
@media (max-width: 60rem) { .beside { grid-template-columns: minmax(0, 1fr); } }
@media (max-width: 40rem) { .chart text { font-size: 17px; } .chart .label { font-size: 14px; } }
@media print {
  :root { --paper: #fff; --ink: #000; --soft: #333; --line: #999; --band: #eee; --accent: #5b34b0;
  --s0: #1c2126; --s1: #5b34b0; --s2: #b34700; --s3: #00705a; --s4: #0b5cad; --s5: #a3246b; }
  main { max-width: none; padding: 0; }
  .scroll, .beside .scroll { overflow: visible; max-height: none; }
  table { font-size: 7pt; }
  th, td { padding: .1rem .25rem; }
  figure, tr, svg { break-inside: avoid; }
  h2, h3 { break-after: avoid; }
}
</style>
</head>
<body>
<main>
)";

/// The beginning of a report page up to <main>; the title is plain text. Nothing is loaded from
/// anywhere and no script may run.                                                       [any]
inline std::string page_head(std::string_view title) {
    return kPageBegin + escape_html(title) + kPageStyle;
}

} // namespace palpate::internal
