# SPDX-License-Identifier: Apache-2.0
"""Charts for bench_page.py: SVG in a page, legible at 360 pixels. Series differ by colour, by marker
and by dash."""
import html
import math

WIDTH, HEIGHT = 360, 270  # units of the drawing: pixels on a narrow screen
LEFT, RIGHT, TOP, BOTTOM = 50, 18, 10, 40
DASHES = ["", "6 3", "2 3", "8 3 2 3", "1 4"]


def text(x, y, words, anchor="middle", kind="", more=""):
    return f'<text class="{kind}" x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"{more}>{html.escape(words)}</text>'


def marker(kind, x, y, series):
    """One of five shapes."""
    r = 4.0
    shapes = [
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{r}"/>',
        f'<rect x="{x - r:.1f}" y="{y - r:.1f}" width="{2 * r}" height="{2 * r}"/>',
        f'<path d="M{x:.1f} {y - 1.3 * r:.1f} l{1.2 * r} {2.1 * r} h{-2.4 * r} z"/>',
        f'<path d="M{x:.1f} {y - 1.4 * r:.1f} l{1.4 * r} {1.4 * r} l{-1.4 * r} {1.4 * r} l{-1.4 * r} {-1.4 * r} z"/>',
        f'<path class="cross" d="M{x - r:.1f} {y - r:.1f} l{2 * r} {2 * r} m0 {-2 * r} l{-2 * r} {2 * r}"/>',
    ]
    return f'<g class="mark s{series}">{shapes[kind]}</g>'


def short(value):
    """A number on an axis: 1, 20, 300, 4k, 5M."""
    for unit, size in (("G", 1e9), ("M", 1e6), ("k", 1e3)):
        if abs(value) >= 0.9995 * size:  # three digits of 999.7 are those of 1k
            return f"{value / size:.3g}{unit}"
    return f"{value:.3g}"


def ticks_of(low, high):
    """Round numbers from below the one to above the other: 1, 2, 5, or powers of ten alone."""
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    steps = (1,) if last - first > 3 else (1, 2, 5)
    every = [step * 10.0**e for e in range(first, last + 1) for step in steps]
    below = max(tick for tick in every if tick <= low * (1 + 1e-9))
    above = min((tick for tick in every if tick >= high * (1 - 1e-9) and tick > below), default=10.0 ** (last + 1))
    return [tick for tick in every if below <= tick < above] + [above]


class Axis:
    """A logarithmic one: values between its ends become pixels."""

    def __init__(self, ticks, start, end):
        self.ticks, self.start, self.end = ticks, start, end
        self.low, self.high = math.log10(ticks[0]), math.log10(ticks[-1])

    def __call__(self, value):
        share = (math.log10(value) - self.low) / (self.high - self.low)
        return self.start + share * (self.end - self.start)


def axis_lines(x, y, x_ticks, x_words, y_words):
    parts = []
    for tick in y.ticks:
        at = y(tick)
        parts.append(f'<path class="grid" d="M{x.start} {at:.1f} H{x.end}"/>')
        parts.append(text(x.start - 5, at + 4, short(tick), "end"))
    for tick, words in x_ticks:
        parts.append(f'<path class="grid" d="M{x(tick):.1f} {y.start} V{y.end}"/>')
        parts.append(text(x(tick), y.start + 15, words))
    parts.append(text(0.5 * (x.start + x.end), y.start + 33, x_words))
    middle = 0.5 * (y.start + y.end)
    parts.append(text(12, middle, y_words, more=f' transform="rotate(-90 12 {middle:.1f})"'))
    return parts


def legend(names, kinds):
    """The lines' own marker, colour and dash."""
    items = []
    for name, kind in zip(names, kinds):
        sample = (f'<svg class="sample" viewBox="0 0 34 14" width="34" height="14" aria-hidden="true">'
                  f'<path class="line s{kind}" stroke-dasharray="{DASHES[kind]}" d="M1 7 H33"/>'
                  f'{marker(kind, 17, 7, kind)}</svg>')
        items.append(f"<li>{sample} {html.escape(name)}</li>")
    return f'<ul class="legend">{"".join(items)}</ul>'


def line_chart(title, x_words, y_words, series, x_names=None):
    """series: {name: [(x, y), ...]}, both logarithmic; x_names: {x: words} where not decades."""
    points = [point for line in series.values() for point in line]
    if not points:
        return ""
    xs = sorted({x for x, _ in points})
    x_low, x_high = (xs[0] / 1.25, xs[-1] * 1.25)
    x_ticks = [(v, w) for v, w in (x_names or {t: short(t) for t in ticks_of(x_low, x_high)}).items()
               if x_low <= v <= x_high]
    x = Axis([x_low, x_high], LEFT, WIDTH - RIGHT)
    y = Axis(ticks_of(min(p[1] for p in points), max(p[1] for p in points)), HEIGHT - BOTTOM, TOP)
    parts = axis_lines(x, y, x_ticks, x_words, y_words)
    for kind, line in enumerate(series.values()):
        way = " ".join(f"{'L' if i else 'M'}{x(a):.1f} {y(b):.1f}" for i, (a, b) in enumerate(line))
        parts.append(f'<path class="line s{kind}" stroke-dasharray="{DASHES[kind]}" d="{way}"/>')
        parts += [marker(kind, x(a), y(b), kind) for a, b in line]
    return figure(title, HEIGHT, parts, legend(series, range(len(series))))


def range_chart(title, x_words, rows):
    """rows: (name, [values]) with the first value as a dot, and a line to the last one. Each row's
    name stands above it, so that it may be long."""
    rows = [(name, [v for v in values if v > 0]) for name, values in rows]
    rows = [(name, values) for name, values in rows if values]
    if not rows:
        return ""
    step, top = 30, 6
    height = top + step * len(rows) + BOTTOM
    every = [v for _, values in rows for v in values]
    x = Axis(ticks_of(min(every), max(every)), 10, WIDTH - 14)
    parts = []
    for tick in x.ticks:
        parts.append(f'<path class="grid" d="M{x(tick):.1f} {top} V{height - BOTTOM}"/>')
        parts.append(text(x(tick), height - BOTTOM + 15, short(tick)))
    parts.append(text(0.5 * WIDTH, height - BOTTOM + 33, x_words))
    for i, (name, values) in enumerate(rows):
        at = top + step * i + 22
        parts.append(text(10, at - 8, f"{name}: {short(values[0])}", "start", "name"))
        parts.append(f'<path class="line s0" d="M{x(values[0]):.1f} {at} H{x(values[-1]):.1f} m0 -4 v8"/>')
        parts.append(marker(0, x(values[0]), at, 0))
    return figure(title, height, parts, "")


def figure(title, height, parts, below):
    drawing = (f'<svg class="chart" viewBox="0 0 {WIDTH} {height}" role="img" '
               f'aria-label="{html.escape(title)}">{"".join(parts)}</svg>')
    return f"<figure><figcaption>{html.escape(title)}</figcaption>{drawing}{below}</figure>"


STYLE = """
:root { color-scheme: light dark; --ink: #1f2328; --paper: #fff; --soft: #59636e; --line: #d1d9e0;
  --s0: #0072b2; --s1: #b84a00; --s2: #007a5a; --s3: #a8457f; --s4: #1f2328; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6edf3; --paper: #0d1117; --soft: #9198a1;
  --line: #3d444d; --s0: #56b4e9; --s1: #f0883e; --s2: #3fc796; --s3: #e58ac0; --s4: #e6edf3; } }
body { color: var(--ink); background: var(--paper); font: 16px/1.45 sans-serif; margin: 0 auto;
  padding: 12px; max-width: 1100px; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.2rem; margin-top: 2rem; }
p, li { max-width: 70ch; } .soft { color: var(--soft); } code { font-size: 0.9em; }
.charts { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 340px), 1fr)); gap: 16px; }
figure { margin: 0; max-width: 540px; break-inside: avoid; } figcaption { font-weight: bold; }
.chart { width: 100%; height: auto; display: block; }
.chart text { fill: var(--ink); font: 12px sans-serif; } .grid { stroke: var(--line); fill: none; }
.line { fill: none; stroke-width: 1.8; } .mark { stroke-width: 1.6; fill: var(--paper); }
.s0 { stroke: var(--s0); } .s1 { stroke: var(--s1); } .s2 { stroke: var(--s2); }
.s3 { stroke: var(--s3); } .s4 { stroke: var(--s4); }
.legend { list-style: none; margin: 4px 0 0; padding: 0; display: flex; flex-wrap: wrap; gap: 2px 14px; }
.sample { vertical-align: -2px; }
.wide { overflow-x: auto; } table { border-collapse: collapse; font-size: 0.875rem; margin: 8px 0; }
th, td { padding: 3px 8px; text-align: right; border-bottom: 1px solid var(--line); white-space: nowrap; }
th:first-child, td:first-child { text-align: left; padding-left: 0; } tr { break-inside: avoid; }
td.words, th.words { text-align: left; white-space: normal; min-width: 13em; }
thead { display: table-header-group; } summary { cursor: pointer; }
@media print { :root { --ink: #000; --paper: #fff; --soft: #444; --line: #bbb; --s0: #0072b2;
  --s1: #b84a00; --s2: #007a5a; --s3: #a8457f; --s4: #000; } .wide { overflow: visible; }
  table { font-size: 8pt; } th, td { padding: 2px 5px; } }
"""
