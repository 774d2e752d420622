# SPDX-License-Identifier: Apache-2.0
"""docs/benchmark.md: its commands run, and its numbers are those of the committed table."""

import csv
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import support
from support import OPEN, PALPATE, ROOT

from enter_palpate import ENTRIES
from files import read_path
from score import COLUMNS
from tracks import FROZEN_SEED, write_tracks

PAGE = (ROOT / "docs" / "benchmark.md").read_text()
TABLE = OPEN / "results" / "epyc_2_cores.csv"
SHOWN = ["level_p99_um", "position_p99_um", "position_max_um", "deepest_um", "fell_through_frames",
         "lost_frames", "ghost_frames", "force_error_max_n", "force_jumps", "time_ratio_p50", "time_ratio_p99"]  # fmt: skip


def shown(column, text):
    """As the page has a number of the table: two digits, and those before the point; of a length
    that an answer cannot say, only that it is less."""
    if not text:
        return ""
    value = float(text)
    if column.endswith(("_um", "_n")) and 0 < value < 1e-6:
        return "< 1e-6"
    return f"{value:.0f}" if value >= 10 else f"{value:.2g}"


def line_of(row):
    cells = (shown(column, row[column]) for column in SHOWN)
    return f"| `{row['entry']}` | `{row['track']}` | {' | '.join(cells)} |"


class Page(unittest.TestCase):
    @unittest.skipUnless(PALPATE, "OPEN_PALPATE is not set")
    def test_its_commands_end_well(self):
        blocks = re.findall(r"^```sh\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
        self.assertGreater(len(blocks), 3)
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            shutil.copytree(OPEN, folder / "bench" / "open")
            (folder / "build").mkdir()
            (folder / "build" / "release").symlink_to(pathlib.Path(PALPATE).parent)
            (folder / "bin").mkdir()
            (folder / "bin" / "python3").symlink_to(sys.executable)
            path = f"{folder / 'bin'}:{os.environ['PATH']}"
            for block in blocks:
                done = subprocess.run(["bash", "-ec", block], cwd=folder, text=True, check=False,
                                      env=dict(os.environ, PATH=path), capture_output=True)  # fmt: skip
                self.assertEqual(done.returncode, 0, block + done.stdout + done.stderr)
            with (folder / "build" / "two.csv").open() as file:
                rows = {(row["entry"], row["track"]) for row in csv.DictReader(file)}
            meshes = ("sphere_20k", "sphere_330k", "plate", "wedge", "grooves")
            self.assertEqual(rows, {("adaptive:mesh", m) for m in meshes} |
                             {("adaptive:volume", "sphere"), ("adaptive:volume", "bumps")})  # fmt: skip

    def rows(self):
        with TABLE.open() as file:
            return list(csv.DictReader(file))

    def test_the_committed_table_has_all_entries_and_can_be_true(self):
        rows = self.rows()
        self.assertEqual(list(rows[0]), ["entry", "track", *COLUMNS])
        entries = {(row["entry"], row["track"]) for row in rows}
        self.assertEqual(len(entries), len(rows))
        meshes = {"sphere_20k", "sphere_330k", "plate", "wedge", "grooves", "skull"}
        wanted = {(e, t) for e in ENTRIES
                  for t in (meshes if e.endswith(":mesh") else {"sphere", "bumps"})}  # fmt: skip
        self.assertEqual(entries, wanted | {("plain_god_object", t) for t in meshes})
        self.assertTrue(TABLE.with_suffix(".machine.json").is_file())
        for row in rows:
            number = {c: float(row[c]) for c in COLUMNS if row[c]}
            for name in ("level", "position"):
                if row[f"{name}_rms_um"]:
                    self.assertLessEqual(number[f"{name}_rms_um"], number[f"{name}_max_um"], row)
                    self.assertLessEqual(number[f"{name}_p99_um"], number[f"{name}_max_um"], row)
            if row["force_error_rms_n"]:
                self.assertLessEqual(number["force_error_rms_n"], number["force_error_max_n"], row)
            self.assertEqual(row["position_rms_um"] == "", row["track"] == "skull")
            self.assertEqual(row["frozen"], "1", row)
            self.assertLessEqual(number["frames_in_contact"], number["frames"])
            self.assertGreater(number["time_ratio_p50"], 0.02, row)
            self.assertLessEqual(number["time_ratio_p50"], number["time_ratio_p99"], row)
            ns = number["time_ratio_p50"] * number["reference_ns_p50"]
            self.assertAlmostEqual(ns / number["ns_p50"], 1, delta=1e-4)  # six digits each

    def test_the_page_has_the_numbers_of_the_table(self):
        lines = page_lines(self.rows())
        self.assertGreater(len(lines), 10)
        for on_page, of_table in lines:
            self.assertEqual(on_page, of_table)

    def test_the_page_says_how_fast_and_how_deep_the_frozen_tracks_are(self):
        said = dict(re.findall(r"^\| `(\w+)` \| [^|]* \| ([^|]*) \|$", PAGE, re.MULTILINE))
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            write_tracks(folder, FROZEN_SEED, ["sphere", "bumps", "grooves"])
            trials = {track: _trials(folder / track) for track in ("sphere", "bumps", "grooves")}
            corners = [line.split() for line in (folder / "grooves" / "mesh.obj").read_text().splitlines()
                       if line.startswith("v ")]  # fmt: skip
        for track in ("sphere", "bumps"):
            medians = [np.median(np.linalg.norm(np.diff(trial, axis=0), axis=1)) for trial in trials[track]]
            slow, medium, fast = (f"{1000 * median:.2f}" for median in medians)  # a frame is 1 ms
            self.assertIn(f"at {slow}, {medium} and {fast} m/s", said[track])
        ground_mm = sorted({float(corner[3]) for corner in corners})[1]  # above the block's bottom
        deep = sum(1000 * trial[:, 2].min() < ground_mm for trial in trials["grooves"])
        self.assertEqual((deep, len(trials["grooves"])), (5, 10))
        self.assertIn("five of ten below their ground", said["grooves"])

    def test_what_the_page_says_of_an_entry_in_python_runs(self):
        (block,) = re.findall(r"^```python[^\n]*\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
        (build,) = re.findall(r"^cc .*$", PAGE, re.MULTILINE)
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            shutil.copytree(OPEN, folder / "bench" / "open")
            (folder / "build").mkdir()
            subprocess.run(["bash", "-ec", build], cwd=folder, check=True)
            program = f"probe = (0.1, 0.2, 0.3)\n{block}print(reference_ns)\n"
            done = subprocess.run([sys.executable, "-c", program], cwd=folder, check=True, text=True,
                                  capture_output=True)  # fmt: skip
        # 192 edges, a division and a root each: not below 100 ns on any machine.
        self.assertGreater(float(done.stdout), 100)


def _trials(track):
    """The positions of each trial, m."""
    times, probes = read_path(track)
    return np.split(probes, np.flatnonzero(times == 0)[1:])


def page_lines(rows):
    """Each line of the page's table, and what it has to be."""
    of = {(row["entry"], row["track"]): row for row in rows}
    lines = re.findall(r"^(\| `([\w:]+)` \| `(\w+)` \| .* \|)$", PAGE, re.MULTILINE)
    return [(line, line_of(of[entry, track])) for line, entry, track in lines]


if __name__ == "__main__":
    if sys.argv[1:] == ["rows"]:  # the lines that the page has to have
        with TABLE.open() as file:
            print("\n".join(line for _, line in page_lines(csv.DictReader(file))))
    else:
        support.main()
