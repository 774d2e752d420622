# SPDX-License-Identifier: Apache-2.0
"""A trace from Python is the command's, bit for bit."""

import csv
import tempfile
import unittest
from pathlib import Path

import numpy as np
from support import CAVITY_TOML, ROOT, cavity, main, run_command, strokes, write_path

import palpate

FRAMES = "frames.csv"


def columns_of(file):
    """The columns of a CSV file, as text."""
    with open(file, encoding="utf-8", newline="") as text:
        header, *rows = csv.reader(text)
    return dict(zip(header, zip(*rows)))


class Traces(unittest.TestCase):
    def assert_same_bits(self, trace, file):
        """What a file says, a trace has."""
        columns = columns_of(file)
        for name, cells in columns.items():
            ours = trace[name]
            self.assertEqual(len(ours), len(cells))
            is_text = name in ("felt", "pressed")
            theirs = np.array(cells) if is_text else np.array(cells, dtype=ours.dtype)
            self.assertEqual(ours.astype(theirs.dtype).tobytes(), theirs.tobytes(), name)
        return columns

    def test_arrays_rows_frames_and_files_give_the_commands_frames(self):
        positions = strokes(4000)
        rows = np.column_stack([np.arange(4000) / 1000.0, positions])
        with tempfile.TemporaryDirectory() as folder:
            scene_file, path = Path(folder) / "cavity.toml", Path(folder) / "path.csv"
            scene_file.write_text(CAVITY_TOML)
            write_path(path, positions)
            for method in ("single", "fixed", "adaptive"):
                said = run_command(
                    *("trace", scene_file, "--device", f"path:{path}", "--method", method),
                    *("--out", method),
                    cwd=folder,
                )
                self.assertEqual(said.returncode, 0, said.stderr)
                scene = palpate.Scene(scene_file)
                for given in (positions, rows, path, positions.tolist(), np.asfortranarray(rows)):
                    trace = palpate.trace(scene, given, method=method)
                    columns = self.assert_same_bits(trace, Path(folder) / method / FRAMES)
                self.assertEqual(trace.columns[: len(columns)], tuple(columns))
                self.assertGreater((trace["felt"] == "wall").sum(), 1000)
                self.assertGreater((trace["felt"] == "").sum(), 1000)

    def test_what_is_soft_has_the_columns_of_frames_csv_too(self):
        text = CAVITY_TOML.replace("[surface.wall]\n", "[surface.wall]\nstiffness_n_per_mm = 0.2\n")
        positions = strokes(2000)
        with tempfile.TemporaryDirectory() as folder:
            scene_file, path = Path(folder) / "cavity.toml", Path(folder) / "path.csv"
            scene_file.write_text(text)
            write_path(path, positions)
            said = run_command(
                *("trace", scene_file, "--device", f"path:{path}", "--out", "out"), cwd=folder
            )
            self.assertEqual(said.returncode, 0, said.stderr)
            scene = palpate.Scene(scene_file)
            trace = palpate.trace(scene, positions)
            columns = self.assert_same_bits(trace, Path(folder) / "out" / FRAMES)
        self.assertIn("pressed", columns)
        self.assertEqual(set(trace["pressed"]), {"", "wall"})
        self.assertIn("stiffness_n_per_mm", trace.summary()["pressed"][0])
        loop = palpate.Loop(scene)
        for i, place in enumerate(positions):
            report = loop.frame(place)
            self.assertEqual(report.pressed, trace["pressed"][i])
            self.assertEqual(report.indentation_m, trace["indentation_m"][i])
            self.assertEqual(report.stiffness_n_per_m, trace["stiffness_n_per_m"][i])
            self.assertEqual(report.front_m[0], trace["front_x_m"][i])

    def test_the_scenes_own_device_and_every_and_frames_too(self):
        scene_file = ROOT / "examples" / "cavity.toml"
        with tempfile.TemporaryDirectory() as folder:
            said = run_command("trace", scene_file, "--every", 3, "--out", "out", cwd=folder)
            self.assertEqual(said.returncode, 0, said.stderr)
            scene = palpate.Scene(scene_file)
            own = palpate.trace(scene, every=3)
            self.assert_same_bits(own, Path(folder) / "out" / FRAMES)
            again = palpate.trace(scene, scene.path(every=3))
            self.assertEqual(own.force_n.tobytes(), again.force_n.tobytes())
            summary = own.summary()
            self.assertEqual(summary["frames"], len(own))

    def test_what_is_said_of_a_generated_path_is_a_warning(self):
        scene = palpate.Scene({**cavity(), "device": {"type": "orbit", "duration_s": 2, "turns": 90}})
        with self.assertWarnsRegex(UserWarning, "the orbit around wall ends after"):
            path = scene.path()
        self.assertEqual(len(path), 2000)

    def test_every_is_of_a_path_or_an_orbit(self):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "recording.h5"
            palpate.trace(palpate.Scene(cavity()), strokes(100)).save(file)
            recorded = {**cavity(), "device": {"type": "recording", "file": str(file)}}
            scene = palpate.Scene(recorded)
            self.assertEqual(len(scene.path()), 100)
            for call in (scene.path, lambda every: palpate.trace(scene, every=every)):
                with self.assertRaisesRegex(palpate.ArgumentError, "every: takes each K-th row"):
                    call(every=2)

    def test_trials_begin_where_a_row_has_no_time(self):
        rows = np.column_stack([np.arange(50) / 1000.0, strokes(50)])
        trace = palpate.trace(palpate.Scene(cavity()), np.vstack([rows, rows, rows]))
        self.assertEqual(np.bincount(trace["trial"]).tolist(), [50, 50, 50])

    def test_a_rate_of_its_own_is_the_scenes(self):
        scene = palpate.Scene(cavity(rate_hz=500.0))
        self.assertEqual(palpate.trace(scene, strokes(10), rate_hz=500)["time_s"][5], 0.01)
        self.assertEqual(palpate.trace(scene, strokes(10))["time_s"][5], 0.01)

    def test_columns_are_views_that_nobody_writes_to_and_outlive_their_trace(self):
        trace = palpate.trace(palpate.Scene(cavity()), strokes(500))
        force = trace["force_x_n"]
        vector = trace.force_n
        self.assertTrue(np.shares_memory(force, vector))
        with self.assertRaises(ValueError):
            force[0] = 1.0
        copy = vector.copy()
        del trace
        palpate.trace(palpate.Scene(cavity()), strokes(500) * 0.5)
        np.testing.assert_array_equal(vector, copy)
        np.testing.assert_array_equal(force, copy[:, 0])

    def test_attributes_say_frame_units_and_version(self):
        trace = palpate.trace(palpate.Scene(cavity()), strokes(5))
        wanted = {"frame": "LPS", "length": "m", "force": "N", "time": "s"}
        self.assertEqual(trace.attributes, {**wanted, "version": palpate.__version__})
        self.assertEqual(len(trace), 5)
        self.assertEqual(tuple(trace), trace.columns)

    def test_positions_that_are_no_numbers_are_held(self):
        positions = strokes(20)
        positions[10] = np.nan
        trace = palpate.trace(palpate.Scene(cavity()), positions)
        self.assertEqual(palpate.flag_names(trace["flags"][10]), ["probe_not_finite"])
        self.assertTrue(np.isfinite(trace.force_n).all())

    def test_a_study_has_the_columns_of_the_command(self):
        positions = strokes(600)
        with tempfile.TemporaryDirectory() as folder:
            scene_file, path = Path(folder) / "cavity.toml", Path(folder) / "path.csv"
            write_path(path, positions)
            scene_file.write_text(CAVITY_TOML + '[device]\ntype = "path"\nfile = "path.csv"\n')
            said = run_command("study", scene_file, "--out", "out", cwd=folder)
            self.assertEqual(said.returncode, 0, said.stderr)
            theirs = columns_of(Path(folder) / "out" / "study.csv")
            ours = palpate.study(palpate.Scene(scene_file), positions)
        self.assertEqual(tuple(theirs), ours.columns)
        # The command extracts a mesh of the formula for this one alone.
        is_ours = [method != "finger_proxy" for method in theirs["method"]]
        for name in ("method", "setting", "evaluations_mean", "level_rms_um"):
            cells = [str(cell) for cell in ours[name]]
            if name != "method":
                cells = ["" if cell == "nan" else float(cell) for cell in cells]
                theirs[name] = [float(cell) if cell else "" for cell in theirs[name]]
            self.assertEqual(cells, [cell for cell, kept in zip(theirs[name], is_ours) if kept])

    def test_a_study_of_soft_layers_is_of_the_one_method_that_they_have(self):
        scene = cavity()
        del scene["effect"][1]
        scene["volume"]["skin"] = {"analytic": "sphere_cavity", "radius_mm": 48}
        scene["surface"]["skin"] = {"volume": "skin", "stiffness_n_per_mm": 0.2}
        scene["effect"].append({"type": "surface", "surface": "skin"})
        study = palpate.study(palpate.Scene(scene), strokes(100), baselines=False)
        self.assertEqual(set(study["method"]), {"adaptive"})

    def test_a_dataframe_goes_in_and_out(self):
        try:
            import pandas
        except ImportError:
            self.skipTest("python3-pandas is not installed")
        scene, positions = palpate.Scene(cavity()), strokes(300)
        path = pandas.DataFrame(positions, columns=["x_m", "y_m", "z_m"])
        with self.assertRaisesRegex(palpate.ArgumentError, "no column t_s"):
            palpate.trace(scene, path)
        path["t_s"] = np.arange(300) / 1000.0
        trace = palpate.trace(scene, path)
        self.assertEqual(trace.force_n.tobytes(), palpate.trace(scene, positions).force_n.tobytes())
        frame = trace.to_dataframe()
        self.assertEqual(tuple(frame.columns), trace.columns)
        self.assertEqual(frame.attrs["frame"], "LPS")
        np.testing.assert_array_equal(frame["proxy_z_m"], trace["proxy_z_m"])


if __name__ == "__main__":
    main()
