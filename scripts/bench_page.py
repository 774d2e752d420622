#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""One page of a run of the benchmarks, and the same as a table.

    scripts/bench_page.py FOLDER

FOLDER has the JSON that ./palpate.sh bench left there, and instructions.csv where valgrind counted.
Writes FOLDER/index.html, which needs no other file, and FOLDER/results.csv, for bench_compare.py.

Exit status: 0 done, 1 an answer of a benchmark was wrong, 2 usage, 3 results cannot be read.
"""
import argparse
import html
import math
import pathlib
import sys

from bench_charts import STYLE, line_chart, range_chart
from bench_results import BadInput, read_run, write_csv

METHODS = ("adaptive", "single", "fixed", "paper")
STREAMS = ("coherent/warm", "contact/warm", "random/warm", "contact/cold")
LEFT_OUT = "left out"


def ns(value):
    """A time with its unit, three digits."""
    if value is None:
        return "-"
    for unit, size in (("s", 1e9), ("ms", 1e6), ("us", 1e3)):
        if value >= 0.9995 * size:  # three digits of 999.7 ns are those of 1 us
            return f"{value / size:.3g} {unit}"
    return f"{value:.3g} ns"


def count(value):
    return "-" if value is None else f"{value:,.0f}"


def times(value):
    return "-" if value is None else f"{value:,.1f}" if value < 10 else f"{value:,.0f}"


def table(head, rows, words=()):
    """`words`: columns of text that may break. Columns in which no row has anything are left out."""
    rows = list(rows)
    if not rows:
        return ""
    kept = [i for i in range(len(head)) if i in words or any(cells[i] != "-" for cells in rows)]

    def row(cells, tag):
        marked = (f'<{tag}{" class=words" if i in words else ""}>{html.escape(str(cells[i]))}</{tag}>'
                  for i in kept)
        return f"<tr>{''.join(marked)}</tr>"

    body = "".join(row(cells, "td") for cells in rows)
    return f'<div class="wide"><table><thead>{row(head, "th")}</thead><tbody>{body}</tbody></table></div>'


def folded(title, content):
    return f"<details><summary>{html.escape(title)}</summary>{content}</details>"


class Floor:
    """A load that waits for the one before it, by how much memory it is one of."""

    def __init__(self, results):
        found = results.benchmarks(r"floor/load/KiB:(\d+)")
        # The least of the repetitions: what disturbs a load makes it slower, never faster.
        self.ns_of = {int(size): results.rows[name, "time"].least for name, (size,) in found}
        if not self.ns_of:
            raise BadInput("bench_floor.json: no loads; run ./palpate.sh bench")

    def of_size(self, mib):
        """Between the sizes that were measured, by their logarithms."""
        kib = max(1.0, 1024.0 * mib)
        sizes = sorted(self.ns_of)
        if kib <= sizes[0] or kib >= sizes[-1]:
            return self.ns_of[sizes[0] if kib <= sizes[0] else sizes[-1]]
        above = next(i for i, size in enumerate(sizes) if size >= kib)
        low, high = sizes[above - 1], sizes[above]
        share = math.log(kib / low) / math.log(high / low)
        return (1 - share) * self.ns_of[low] + share * self.ns_of[high]

    def first_cache(self):
        return self.ns_of[min(self.ns_of)]

    def memory(self):
        return self.ns_of[max(self.ns_of)]

    def under(self, results, name):
        """The floor of a row: memory where caches are cold, the data's own size for random places,
        else the first cache."""
        if name.endswith("/cold"):
            return self.memory()
        if "/random/" in name:
            return self.of_size(results.value(name, "data_mib") or 0.0)
        return self.first_cache()


def percentiles(results, name):
    return [results.value(name, f"{p}_ns") for p in ("p50", "p99", "p999", "max")]


# Parts of the page -------------------------------------------------------------------------------


def about(results):
    rows = "".join(f"<tr><td>{html.escape(key)}</td><td class=words>{html.escape(words)}</td></tr>"
                   for key, words in results.machine.items())
    counted = any(quantity == "instructions" for _, quantity in results.rows)
    words = ("Instructions of single queries and frames are the kernel's count." if counted else
             "This kernel gives no count of instructions (perf_event_open), so queries have none.")
    return f'<div class="wide"><table><tbody>{rows}</tbody></table></div><p class="soft">{words}</p>'


def wrong_ones(results):
    wrong = [one for one in results.said if not one[1].startswith(LEFT_OUT)]
    left = [one for one in results.said if one[1].startswith(LEFT_OUT)]
    parts = []
    if wrong:
        parts.append("<h2>Wrong answers</h2>" + table(["benchmark", "what is wrong"], wrong, [1]))
    else:
        parts.append("<p>Every benchmark checked its answers; all were right.</p>")
    if left:
        parts.append(table(["left out", "why"], left, [1]))
    return "".join(parts)


def floor_part(results, floor):
    chart = line_chart("A load that waits for the one before it, ns", "memory that it is one of, bytes",
                       "ns", {"one load": sorted(floor.ns_of.items())},
                       {4: "4 Ki", 64: "64 Ki", 1024: "1 Mi", 16384: "16 Mi", 262144: "256 Mi"})
    rows = [(f"{size} KiB", ns(value)) for size, value in sorted(floor.ns_of.items())]
    rows.append(("one reading of the clock", ns(results.value("floor/clock_reading", "time"))))
    return ("<h2>The floor</h2><p>Nothing that reads memory is faster than one load. Below, "
            "<b>x floor</b> is a time divided by one load, measured in the same run: from memory where "
            "caches are cold, from a set as large as the data where places are random, else from the "
            f'first cache.</p><div class="charts">{chart}<div>{table(["load from", "time"], rows)}</div></div>')


SIZES = {"20k": 2e4, "100k": 1e5, "500k": 5e5, "2M": 2e6, "5M": 5e6}


def by_size(results, name, sizes):
    """(size, median) where it was measured."""
    found = ((value, results.value(name.format(size), "p50_ns")) for size, value in sizes.items())
    return [(x, y) for x, y in found if y]


def query_rows(results, floor, pattern, head):
    rows = []
    for name, groups in results.benchmarks(pattern):
        p50, p99, p999, most = percentiles(results, name)
        rows.append((*groups, ns(p50), ns(p99), ns(p999), ns(most),
                     count(results.value(name, "instructions")),
                     times(p50 / floor.under(results, name) if p50 else None)))
    return table([*head, "p50", "p99", "p99.9", "max", "instructions", "x floor"], rows)


def mesh_part(results, floor):
    charts = []
    for ask, words in (("first_hit", "First hit of a segment"), ("closest_point", "Closest point")):
        series = {"Embree, warm": "embree/{}/contact/warm", "Embree, random": "embree/{}/random/warm",
                  "Embree, cold": "embree/{}/contact/cold", "CGAL, warm": "cgal/{}/contact/warm",
                  "CGAL, random": "cgal/{}/random/warm"}
        lines = {who: by_size(results, f"mesh/{ask}/{name}", SIZES) for who, name in series.items()}
        charts.append(line_chart(f"{words}, median ns", "triangles", "ns",
                                 {who: line for who, line in lines.items() if line},
                                 {value: size for size, value in SIZES.items()}))
    rows = query_rows(results, floor, r"mesh/(\w+)/(\w+)/(\w+)/(\w+)/(\w+)",
                      ["query", "by", "mesh", "places", "caches"])
    return ("<h2>Queries to a mesh</h2><p>By this library (Embree finds candidates, double decides), by "
            "CGAL's AABB tree, and by looking at every triangle, which the charts leave out: it takes "
            "thousands of times as long.</p>"
            f'<div class="charts">{"".join(charts)}</div>{folded("All queries to meshes", rows)}')


VOXELS = {str(n): float(n) for n in (64, 128, 256, 512)}
ASKED = {"value": "value/sampler", "value, OpenVDB's": "value/openvdb",
         "gradient and Hessian": "gradient_hessian/sampler",
         "gradient, OpenVDB's": "gradient_by_six_values/openvdb", "first root": "first_root/sampler"}


def volume_part(results, floor):
    charts = []
    for stream, words in (("contact/warm", "as a hand moves, warm"), ("random/warm", "anywhere"),
                          ("contact/cold", "cold caches")):
        lines = {who: by_size(results, f"volume/{name}/{{}}/{stream}", VOXELS)
                 for who, name in ASKED.items()}
        charts.append(line_chart(f"Queries to a volume, {words}, median ns", "voxels along an edge", "ns",
                                 {who: line for who, line in lines.items() if line},
                                 {value: size for size, value in VOXELS.items()}))
    rows = query_rows(results, floor, r"volume/(\w+)/(\w+)/(\w+)/(\w+)/(\w+)",
                      ["query", "by", "volume", "places", "caches"])
    return ('<h2>Queries to a volume</h2><div class="charts">' + "".join(charts) + "</div>"
            + folded("All queries to volumes", rows))


def frames_part(results, floor):
    contacts = dict.fromkeys(contact for _, (_, contact) in results.benchmarks(r"frame/(\w+)/(\w+)"))
    ranges = [(contact.replace("_", " "), [v for v in percentiles(results, f"frame/adaptive/{contact}")[:3] if v])
              for contact in contacts]
    chart = range_chart("A frame of method adaptive: p50 (circle) to p99.9, ns", "ns", ranges)
    sub_steps = [(contact.replace("_", " "),
                  [v for m in ("fixed", "paper") if (v := results.value(f"frame/{m}/{contact}", "sub_step_ns"))])
                 for contact in contacts]
    second = range_chart("A sub-step: one of 8 in a frame (circle), and of as many as fit into 0.9 ms, ns", "ns", sub_steps)
    rows = []
    for name, (method, contact) in results.benchmarks(r"frame/(\w+)/(\w+)"):
        p50, p99, p999, most = percentiles(results, name)
        sub_step = results.value(name, "sub_step_ns")
        rows.append((contact.replace("_", " "), method, ns(p50), ns(p99), ns(p999), ns(most), ns(sub_step),
                     times(results.value(name, "evaluations")), count(results.value(name, "instructions")),
                     count(results.value(name, "sub_steps_p50")),
                     f"{results.value(name, 'off_um') or 0:.2g}",
                     "-" if method == "paper" else times(p50 / floor.first_cache())))
    order = [contact.replace("_", " ") for contact in contacts]
    rows.sort(key=lambda row: (order.index(row[0]), METHODS.index(row[1])))
    alone = [(name.removeprefix("advance/").replace("_", " "), *map(ns, percentiles(results, name)),
              count(results.value(name, "instructions")),
              times(results.value(name, "p50_ns") / floor.first_cache()))
             for name, _ in results.benchmarks(r"advance/\w+")]
    return ("<h2>Whole frames</h2><p>One frame of HapticLoop, by what is felt and by method. <b>off</b> is "
            "how far the proxy is from the surface (rms); <b>in 0.9 ms</b> is the median number of "
            "sub-steps of method paper, which fills that time in every frame: its frames are the first 500 "
            "of the hand's way, those of the others up to 5000.</p>"
            f'<div class="charts">{chart}{second}</div>'
            + table(["felt", "method", "p50", "p99", "p99.9", "max", "a sub-step", "evaluations",
                     "instructions", "in 0.9 ms", "off, um", "x floor"], rows)
            + "<h3>The movement of the proxy alone (Subdivision::advance)</h3>"
            + table(["felt", "p50", "p99", "p99.9", "max", "instructions", "x floor"], alone))


def instructions_part(results):
    names = [name for name, _ in results.benchmarks(r"instructions/.+")]
    if not names:
        return ("<h2>Instructions, exactly</h2><p>Not counted: valgrind is not installed. "
                "<code>scripts/bench_instructions.py</code> counts them where it is.</p>")
    rows = [(name.removeprefix("instructions/"),
             *(count(results.value(name, q)) for q in ("frame", "advance", "sub_step"))) for name in names]
    chart = range_chart("Instructions of a frame (circle) and of one more sub-step", "instructions",
                        [(name.removeprefix("instructions/"),
                          [v for q in ("frame", "sub_step") if (v := results.value(name, q))])
                         for name in names])
    return ("<h2>Instructions, exactly</h2><p>Counted by callgrind, by <code>scripts/bench_instructions.py"
            "</code>: the same on every machine with this compiler.</p>"
            f'<div class="charts">{chart}<div>{table(["scene", "frame", "advance", "sub-step"], rows)}</div></div>')


def others_part(results):
    shown = ("mesh/", "volume/", "frame/", "advance/", "floor/", "instructions/")
    rows = []
    for name in dict.fromkeys(benchmark for benchmark, _ in results.rows):
        if name.startswith(shown):
            continue
        quantities = [row for row in results.rows.values() if row.benchmark == name]
        rows += [(row.benchmark, row.quantity.removesuffix("_" + row.unit) if row.unit else row.quantity,
                  f"{row.median:.4g}", row.unit, f"{row.least:.4g}", f"{row.most:.4g}") for row in quantities]
    content = table(["benchmark", "quantity", "median", "unit", "least", "most"], rows)
    return f"<h2>The other benchmarks</h2>{folded('Effects, bodies, meshes at speed, traces, first touch, jitter', content)}"


def page(results):
    floor = Floor(results)
    parts = [about(results), wrong_ones(results), frames_part(results, floor), floor_part(results, floor),
             mesh_part(results, floor), volume_part(results, floor), instructions_part(results),
             others_part(results)]
    return ('<!doctype html><html lang="en"><head><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width, initial-scale=1">'
            f"<title>Palpate: what it costs</title><style>{STYLE}</style></head><body>"
            f"<h1>Palpate: what it costs</h1>{''.join(parts)}</body></html>\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", metavar="FOLDER", type=pathlib.Path)
    folder = parser.parse_args().folder
    try:
        results = read_run(folder)
        text = page(results)
    except BadInput as words:
        print(f"bench_page.py: {words}", file=sys.stderr)
        return 3
    write_csv(folder / "results.csv", results)
    part = folder / "index.html.part"
    part.write_text(text)
    part.rename(folder / "index.html")
    wrong = [name for name, words in results.said if not words.startswith(LEFT_OUT)]
    for name in wrong:
        print(f"bench_page.py: {name}: a wrong answer; see the page", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
