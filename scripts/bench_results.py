# SPDX-License-Identifier: Apache-2.0
"""What benchmarks measured: read from the JSON of a run, kept as one table (CSV), read back.

A table has a row for each quantity of each benchmark: the median of the runs, and the least and the
most of them, which say how noisy it is. Lines above it that begin with # describe the machine.
"""
import csv
import datetime
import json
import math
import os
import pathlib
import platform
import re
import statistics
import subprocess

COLUMNS = ["benchmark", "quantity", "unit", "runs", "median", "least", "most"]
TO_NS = {"ns": 1.0, "us": 1e3, "ms": 1e6, "s": 1e9}
UNITS = ("ns", "us", "ms", "s", "um", "mib", "gib", "n", "deg")
OF_GOOGLE_BENCHMARK = {  # what is not a counter
    "name", "family_index", "per_family_instance_index", "run_name", "run_type", "repetitions",
    "repetition_index", "threads", "iterations", "real_time", "cpu_time", "time_unit",
    "error_occurred", "error_message", "label", "aggregate_name", "aggregate_unit",
}


class BadInput(Exception):
    """One line: the file, its line, what is wrong, what to do."""


class Row:
    """One quantity of one benchmark."""

    def __init__(self, benchmark, quantity, unit, runs, median, least, most):
        self.benchmark, self.quantity, self.unit, self.runs = benchmark, quantity, unit, runs
        self.median, self.least, self.most = median, least, most

    @property
    def key(self):
        return self.benchmark, self.quantity

    @property
    def spread(self):
        return self.most - self.least


class Results:
    """All rows of a run by (benchmark, quantity), the machine, and rows without a number."""

    def __init__(self, machine, rows, said=None):
        self.machine, self.rows, self.said = machine, {row.key: row for row in rows}, said or []

    def value(self, benchmark, quantity):
        row = self.rows.get((benchmark, quantity))
        return row.median if row else None

    def benchmarks(self, pattern):
        """Names that match a whole regular expression, with its groups, as they were measured."""
        names = dict.fromkeys(benchmark for benchmark, _ in self.rows)
        matches = ((name, re.fullmatch(pattern, name)) for name in names)
        return [(name, match.groups()) for name, match in matches if match]


# From the JSON of a run --------------------------------------------------------------------------


def read_json(file):
    try:
        return json.loads(file.read_text())
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(f"{file}: cannot be read ({error}); run ./palpate.sh bench") from error
    except json.JSONDecodeError as error:
        raise BadInput(f"{file}:{error.lineno}: no JSON; run ./palpate.sh bench again") from error


def name_of(run_name):
    return re.sub(r"/(iterations:\d+|manual_time|real_time|repeats:\d+|min_time:[\d.]+)", "", run_name)


def unit_of(counter):
    """The unit is the counter's last word."""
    last = counter.rsplit("_", 1)[-1]
    if last in UNITS and last != counter:
        return last
    return "instructions" if counter == "instructions" else ""


def numbers_of(run):
    """(quantity, unit, number) of one repetition; times in ns."""
    yield "time", "ns", run["real_time"] * TO_NS[run["time_unit"]]
    for counter, number in run.items():
        if counter not in OF_GOOGLE_BENCHMARK:
            yield counter, unit_of(counter), number


def place_of(run):
    """Repetitions come in turns, at random: back to the order of the program."""
    return run.get("family_index", 0), run.get("per_family_instance_index", 0)


def numbers_of_jitter(runs):
    """(benchmark, quantity, unit, number): bench_jitter and bench_view_jitter are no Google Benchmarks.
    Where SCHED_FIFO is not granted, two of their runs have one name."""
    for run in runs:
        name = "/".join(["jitter", run["method"], run["scheduler"], run["machine"]])
        for counter, number in run.items():
            if counter not in ("method", "scheduler", "machine"):
                yield name, counter, unit_of(counter), number


def read_run(folder):
    """All *.json of a folder, and instructions.csv beside them."""
    found, said, context = {}, [], {}
    rows = []
    files = sorted(folder.glob("*.json"))
    if not files:
        raise BadInput(f"{folder}: no results in JSON; run ./palpate.sh bench")
    for file in files:
        run = read_json(file)
        if isinstance(run, list):
            for name, quantity, unit, number in numbers_of_jitter(run):
                found.setdefault((name, quantity, unit), []).append(number)
            continue
        context = run.get("context", context)
        program = file.stem.removeprefix("bench_")
        for one in sorted(run.get("benchmarks", []), key=place_of):
            if one.get("run_type") == "aggregate":
                continue
            name = name_of(one["run_name"])
            name = name if "/" in name and program in NAMED_BY_THEMSELVES else f"{program}/{name}"
            if one.get("error_occurred"):
                if (name, one["error_message"]) not in said:
                    said.append((name, one["error_message"]))
                continue
            for quantity, unit, number in numbers_of(one):
                found.setdefault((name, quantity, unit), []).append(number)
    for (name, quantity, unit), numbers in found.items():
        median = statistics.median(numbers)
        rows.append(Row(name, quantity, unit, len(numbers), median, min(numbers), max(numbers)))
    counted = folder / "instructions.csv"
    if counted.exists():
        rows += read_csv(counted).rows.values()
    return Results(machine_of(context), rows, said)


NAMED_BY_THEMSELVES = ("mesh_query_cost", "query_cost", "frame_cost")  # mesh/..., volume/..., frame/...


# The machine -------------------------------------------------------------------------------------


def first_line(*command):
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return (done.stdout.splitlines() or ["unknown"])[0].strip()


def processor():
    try:
        text = pathlib.Path("/proc/cpuinfo").read_text()
    except OSError:
        return "unknown"
    found = re.search(r"^model name\s*:\s*(.+)$", text, re.M)
    return found.group(1) if found else platform.machine()


def machine_of(context):
    """What the numbers of a run were measured on: `context` is Google Benchmark's."""
    caches = ", ".join(
        f"L{c['level']} {c['type'].lower()} {c['size'] // 1024} KiB"
        for c in context.get("caches", [])
    )
    load = context.get("load_avg", [])
    return {
        "date": datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d %H:%M UTC"),
        "commit": first_line("git", "-C", str(pathlib.Path(__file__).parent), "describe",
                             "--always", "--dirty"),
        "processor": f"{processor()}, {os.cpu_count()} cores, {context.get('mhz_per_cpu', '?')} MHz",
        "caches": caches or "unknown",
        "system": f"{platform.system()} {platform.release()}",
        "compiler": first_line(os.environ.get("CXX", "c++"), "--version"),
        "load": f"{load[0]:.2f} when the last benchmark began" if load else "unknown",
    }


# The table ---------------------------------------------------------------------------------------


def write_csv(file, results):
    """Complete under its name, or not there."""
    part = file.with_name(file.name + ".part")
    with open(part, "w", newline="") as out:
        for key, words in results.machine.items():
            out.write(f"# {key}: {words}\n")
        rows = csv.writer(out, lineterminator="\n")
        rows.writerow(COLUMNS)
        for row in sorted(results.rows.values(), key=lambda row: row.key):
            numbers = [f"{n:.6g}" for n in (row.median, row.least, row.most)]
            rows.writerow([row.benchmark, row.quantity, row.unit, row.runs, *numbers])
    part.rename(file)


def number(text, file, line, column):
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise BadInput(f"{file}:{line}: {column} is \"{text}\", no number; write the table anew with "
                       "./palpate.sh bench")
    return value


def row_of(cells, file, line):
    if len(cells) != len(COLUMNS):
        raise BadInput(f"{file}:{line}: {len(cells)} columns, not the {len(COLUMNS)} of the header; "
                       "write the table anew with ./palpate.sh bench")
    values = dict(zip(COLUMNS, cells))
    median, least, most = (number(values[c], file, line, c) for c in ("median", "least", "most"))
    runs = number(values["runs"], file, line, "runs")
    if not least <= median <= most or runs < 1:
        raise BadInput(f"{file}:{line}: least {least:g}, median {median:g}, most {most:g} of {runs:g} "
                       "runs are not in order; write the table anew with ./palpate.sh bench")
    return Row(values["benchmark"], values["quantity"], values["unit"], int(runs), median, least, most)


def read_csv(file):
    try:
        text = pathlib.Path(file).read_text()
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "it is no text"
        raise BadInput(f"{file}: cannot be read ({why}); give a table of ./palpate.sh bench") from error
    machine, rows, header, line_of = {}, [], None, {}
    for line, words in enumerate(text.splitlines(), 1):
        if words.startswith("#"):
            key, _, said = words[1:].partition(":")
            machine[key.strip()] = said.strip()
        elif header is None:
            header = next(csv.reader([words]), [])
            if header != COLUMNS:
                raise BadInput(f"{file}:{line}: the columns are {','.join(header)}; they have to be "
                               f"{','.join(COLUMNS)}")
        elif words.strip():
            row = row_of(next(csv.reader([words])), file, line)
            first = line_of.setdefault(row.key, line)
            if first != line:
                raise BadInput(f"{file}:{line}: {row.benchmark} {row.quantity} is in line {first} "
                               "already; write the table anew with ./palpate.sh bench")
            rows.append(row)
    if not rows:
        raise BadInput(f"{file}: no rows; give a table of ./palpate.sh bench")
    return Results(machine, rows)
