# SPDX-License-Identifier: Apache-2.0
"""Many studies: one after the other, over Dask with a worker killed, as a job array; resumable."""

import importlib.util
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path

import numpy as np
from support import ROOT, cavity, main, run_python, strokes, write_path

import palpate

CAN_EXTRACT = importlib.util.find_spec("palpate._extraction") is not None
TABLE, TIMING = "study_many.csv", "study_many_timing.csv"
FRAMES = 60  # of a path: a unit takes some seconds with it, which method paper needs


def with_radius(radius_mm, **loop):
    scene = cavity(**loop)
    scene["volume"]["cavity"]["radius_mm"] = radius_mm
    return scene


def make_units(folder, count=4):
    """Units of several scans, and their paths, as a JSON file; budgets keep method paper short."""
    write_path(folder / "path.csv", strokes(FRAMES), rate_hz=4000.0)
    units = [
        {
            "scan": f"p{i:02}",
            "structure": "Left, upper",
            "scene": with_radius(49.0 + i, rate_hz=4000.0),
            "path": "path.csv",
        }
        for i in range(count)
    ]
    file = folder / "units.json"
    file.write_text(json.dumps(units))
    return file


def results_of(folder):
    return sorted(file for file in folder.glob("*.json"))


_FULL = """
import json, resource, signal, sys
import palpate
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (600, resource.RLIM_INFINITY))
try:
    palpate.merge_studies(json.loads(sys.argv[2]), out=sys.argv[1])
except palpate.FileError as error:
    print(error)
"""


class Many(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)
        cls.units = make_units(cls.folder)
        cls.serial = palpate.study_many(cls.units, out=cls.folder / "serial")
        cls.table = (cls.folder / "serial" / TABLE).read_bytes()

    def command(self, *arguments):
        return subprocess.run(
            [sys.executable, "-m", "palpate", "study_many", *map(str, arguments)],
            capture_output=True,
            text=True,
            check=False,
        )

    def test_the_table_has_the_rows_of_each_study(self):
        one = palpate.study(
            palpate.Scene(with_radius(50.0, rate_hz=4000.0)), strokes(FRAMES), baselines=True
        )
        rows = self.serial["scan"] == "p01"
        wanted = one["method"] != "paper"
        self.assertGreater(wanted.sum(), 15)
        self.assertEqual(self.serial["method"][rows].tolist(), one["method"][wanted].tolist())
        for name in ("setting", "evaluations_mean", "level_rms_um", "deepest_um"):
            np.testing.assert_array_equal(self.serial[name][rows], one[name][wanted], name)
        self.assertEqual(set(self.serial["structure"]), {"Left, upper"})
        self.assertEqual(self.serial.columns[:3], ("scan", "structure", "method"))
        clock = {name for name in one.columns if name.startswith(("spent", "late", "over"))}
        self.assertEqual(set(one.columns) - set(self.serial.columns), clock)
        self.assertEqual(set(self.serial.timing.columns) - set(self.serial.columns), clock)
        self.assertIn("paper", self.serial.timing["method"])
        self.assertEqual(len(self.serial.timing), 4 * len(one))

    def test_what_is_there_is_not_computed_again_and_what_changed_is(self):
        out = self.folder / "serial"
        before = {file: file.stat().st_mtime_ns for file in results_of(out)}
        self.assertEqual(len(before), 4)
        units = json.loads(self.units.read_text())
        for unit in units:
            unit["path"] = os.fspath(self.folder / unit["path"])
        again = palpate.study_many(self.units, out=out)
        self.assertEqual({file: file.stat().st_mtime_ns for file in results_of(out)}, before)
        self.assertEqual(again.timing.text, self.serial.timing.text)
        units[2]["scene"]["volume"]["cavity"]["radius_mm"] = 48.0
        changed = self.folder / "changed.json"
        changed.write_text(json.dumps(units))
        with self.assertRaisesRegex(palpate.Error, r"no result of 1 of 4 .*units\[2\]"):
            palpate.merge_studies(changed, out=out)
        palpate.study_many(changed, out=out)
        after = {file: file.stat().st_mtime_ns for file in results_of(out)}
        different = [file for file in before if before[file] != after[file]]
        self.assertEqual([file.name[:3] for file in different], ["p02"])
        palpate.study_many(self.units, out=out)
        self.assertEqual((out / TABLE).read_bytes(), self.table)

    def test_a_changed_file_is_another_result(self):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            units = make_units(folder, 1)
            palpate.study_unit(units, 0, out=folder / "out")
            (first,) = results_of(folder / "out")
            before = first.read_bytes()
            palpate.merge_studies(units, out=folder / "out")
            write_path(folder / "path.csv", 0.99 * strokes(FRAMES), rate_hz=4000.0)
            with self.assertRaisesRegex(palpate.Error, "no result of 1 of 1 units"):
                palpate.merge_studies(units, out=folder / "out")
            palpate.study_unit(units, 0, out=folder / "out")
            self.assertNotEqual(first.read_bytes(), before)

    @unittest.skipUnless(CAN_EXTRACT, "this build of the package makes no meshes of volumes")
    def test_with_extraction_is_another_result_than_without(self):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            out = folder / "out"
            write_path(folder / "path.csv", strokes(20), rate_hz=4000.0)
            common = {
                "structure": "wall",
                "scene": with_radius(50.0, rate_hz=4000.0),
                "path": os.fspath(folder / "path.csv"),
                "baselines": False,
            }
            units = [{"scan": scan, **common} for scan in ("p00", "p01")]

            def texts():
                return [file.read_text() for file in results_of(out)]

            palpate.study_many(units, out=out, extraction=False)
            without = texts()
            palpate.study_unit(units, 0, out=out, extraction=True)
            self.assertEqual([a == b for a, b in zip(texts(), without)], [False, True])
            with self.assertRaisesRegex(palpate.Error, "some .* with extraction and some without"):
                palpate.merge_studies(units, out=out)
            palpate.study_many(units, out=out)  # where it is there, it is taken
            extracted = texts()
            self.assertNotEqual(extracted[1], without[1])
            palpate.study_many(units, out=out, extraction=True)
            self.assertEqual(texts(), extracted)  # its times would be others

    def test_a_job_array_and_parallel_processes_give_the_same_table(self):
        out = self.folder / "array"
        count = self.command(self.units, "--count")
        self.assertEqual(count.stdout, "4\n", count.stderr)
        self.assertEqual(self.command(self.units, "--merge", "--out", out).returncode, 3)
        one = self.command(self.units, "--unit", 3, "--out", out)
        self.assertEqual((one.returncode, one.stderr), (0, ""))
        self.assertEqual([file.name[:3] for file in results_of(out)], ["p03"])
        # The lines of docs/python.md as they are, but for who starts the jobs: xargs, two at a
        # time, {} is the number of a unit; and Slurm's environment.
        page = (ROOT / "docs" / "python.md").read_text()
        count, job, parallel, merge = re.search(
            r"^(n=.*)\nsbatch .*\n    '(.*)'\n(seq .*)\n(python3 .*)\n",
            page,
            re.MULTILINE,
        ).groups()
        self.assertEqual(merge.count("--merge"), 1)
        here = out.parent / "documented"
        here.mkdir()
        for name in ("units.json", "path.csv"):
            (here / name).write_bytes((self.folder / name).read_bytes())
        lines = [count, parallel.replace("| parallel", "| xargs -P 2 -I {}"), merge]
        lines = ["set -e", f"python3() {{ {sys.executable} \"$@\"; }}", *lines]
        lines[3] = lines[3].replace(" python3 ", f" {sys.executable} ")
        subprocess.run(["bash", "-c", "\n".join(lines)], cwd=here, check=True)
        self.assertEqual((here / "results" / TABLE).read_bytes(), self.table)
        results_of(here / "results")[2].unlink()
        environment = {**os.environ, "SLURM_ARRAY_TASK_ID": "2"}
        job = job.replace("python3", sys.executable, 1)
        subprocess.run(["bash", "-c", job], cwd=here, env=environment, check=True)
        self.assertEqual(len(results_of(here / "results")), 4)
        missing = self.command(self.units, "--unit", 4, "--out", out)
        self.assertEqual(missing.returncode, 3)
        line = "palpate: unit = 4 is out of range; give an integer in [0, 3]\n"
        self.assertEqual(missing.stderr, line)

    def test_a_unit_that_fails_leaves_the_others_and_says_which(self):
        units = json.loads(self.units.read_text())[:2]
        for unit in units:
            unit["path"] = os.fspath(self.folder / unit["path"])
        units[0]["scene"]["effect"][0]["surface"] = "wal"
        out = self.folder / "failed"
        with self.assertRaises(palpate.Error) as caught:
            palpate.study_many(iter(units), out=out)
        line = str(caught.exception)
        self.assertRegex(line, "^1 of 2 units failed: scan p00, structure Left, upper: [^\n]*; ")
        self.assertIn("dict: effect[0]: ", line)
        self.assertEqual([file.name[:3] for file in results_of(out)], ["p01"])
        self.assertFalse((out / TABLE).exists())

    def test_a_unit_that_is_none_is_refused_before_anything_is_computed(self):
        good = {"scan": "a", "structure": "b", "scene": cavity()}
        for units, *parts in (
            ([], "units: are none"),
            ({}, "units: are no list"),
            (3, "units: are no list"),
            ([3], "units[0]: is of type int"),
            ([{**good, "scan": 3}], "units[0]: scan = 3"),
            ([{**good, "scan": "a\nb"}], "units[0]: scan = "),
            ([good, {**good}], "units[1]: has scan and structure of units[0]"),
            ([{**good, "pth": "x"}], "unknown key 'pth'", "path"),
            ([{**good, "scene": 3}], "scene is of type int"),
            ([{**good, "path": [[0, 0, 0]]}], "path is of type list"),
            ([good, {**good, "scan": "c", "path": "a\0b.csv"}], "units[1]: path = ", "none"),
            ([{**good, "path": "\ud800.csv"}], "units[0]: path = "),
            ([{**good, "scene": "a\0.toml"}], "units[0]: scene = "),
            ([{**good, "every": 0}], "units[0]: every = 0"),
            ([{**good, "every": True}], "units[0]: every = True"),
            ([{**good, "every": 2.0}], "units[0]: every"),
            ([good, {**good, "structure": "c", "every": 2**31}], "units[1]: every = 2147483648"),
            ([{**good, "scene": {"loop": {"rate_hz": None}}}], "units[0]: ", "loop.rate_hz"),
            ([{**good, "baselines": 1}], "baselines = 1"),
        ):
            with self.assertRaises(palpate.ArgumentError) as caught:
                palpate.study_many(units, out=self.folder / "none")
            for part in parts:
                self.assertIn(part, str(caught.exception))
        self.assertFalse((self.folder / "none").exists())
        bad = self.folder / "bad.json"
        bad.write_text("[")
        for file in (bad, self.folder / "missing.json"):
            with self.assertRaisesRegex(palpate.FileError, file.name):
                palpate.study_many(file, out=self.folder / "none")

    def test_files_of_others_are_not_replaced(self):
        for name in (results_of(self.folder / "serial")[0].name, TABLE):
            out = self.folder / f"others-{name}"
            out.mkdir()
            (out / name).write_text("not ours\n")
            with self.assertRaisesRegex(palpate.Error, "name another folder as out"):
                palpate.study_many(self.units, out=out)
            self.assertEqual((out / name).read_text(), "not ours\n")

    def test_without_distributed_a_client_is_refused_with_what_to_install(self):
        program = """
import sys
sys.modules["distributed"] = None
import palpate
try:
    palpate.study_many([], client=object())
except palpate.Error as error:
    print(error)
"""
        outcome = run_python(program)
        self.assertIn("install python3-distributed", outcome.stdout, outcome.stderr)

    @unittest.skipUnless(importlib.util.find_spec("distributed"), "needs python3-distributed")
    def test_two_workers_one_of_them_killed_give_the_serial_tables_bits(self):
        import distributed

        with self.assertRaisesRegex(TypeError, "client is of type str"):
            palpate.study_many(self.units, client="local")
        out = self.folder / "dask"
        with distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster, distributed.Client(cluster) as client:
            before = set(client.run(os.getpid).values())
            self.assertEqual(len(before), 2)
            killed, done = [], []

            def kill_one_at_work():
                while not results_of(out):
                    time.sleep(0.01)
                busy = [worker for worker, keys in client.processing().items() if keys]
                killed.append(client.run(os.getpid, workers=busy[:1])[busy[0]])
                os.kill(killed[0], signal.SIGKILL)
                done.extend(results_of(out))

            killer = threading.Thread(target=kill_one_at_work)
            killer.start()
            over_dask = palpate.study_many(self.units, client, out=out)
            killer.join()
            self.assertEqual(len(killed), 1)
            self.assertLess(len(done), len(results_of(out)))  # it was midway
            self.assertIn(killed[0], before)
            self.assertNotIn(killed[0], client.run(os.getpid).values())
        self.assertEqual((out / TABLE).read_bytes(), self.table)
        self.assertEqual(over_dask.text, self.serial.text)
        self.assertEqual(list(out.glob(".*")), [])

    def test_a_full_disk_is_told(self):
        device = {"type": "orbit", "duration_s": 0.05}
        units = [{"scan": "a", "structure": "b", "scene": {**cavity(), "device": device}}]
        units[0]["baselines"] = False
        with tempfile.TemporaryDirectory() as folder:
            palpate.study_many(units, out=folder)
            said = run_python(_FULL, folder, json.dumps(units))
        self.assertIn("; name a folder that can be written", said.stdout, said.stderr)


if __name__ == "__main__":
    main()
