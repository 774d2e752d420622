# SPDX-License-Identifier: Apache-2.0
"""What is wrong becomes an exception with the line that the command prints."""

import os
import tempfile
import unittest
from pathlib import Path

import numpy as np
from support import CAVITY_TOML, cavity, main, run_command, strokes

import palpate


def changed(table, key, value):
    """The cavity with another value."""
    scene = cavity()
    at = scene
    for part in table:
        at = at[part]
    at[key] = value
    return scene


class Errors(unittest.TestCase):
    def line_of(self, kind, call, *parts):
        """The one line of an exception of this kind, which has these parts."""
        with self.assertRaises(kind) as caught:
            call()
        self.assertIsInstance(caught.exception, palpate.Error)
        line = str(caught.exception)
        self.assertNotIn("\n", line)
        for part in parts:
            self.assertIn(part, line)
        return line

    def test_classes_are_pythons_own_as_well(self):
        self.assertTrue(issubclass(palpate.SceneError, ValueError))
        self.assertTrue(issubclass(palpate.FileError, OSError))
        self.assertTrue(issubclass(palpate.ArgumentError, ValueError))

    def test_a_dict_is_refused_with_its_key_value_and_remedy(self):
        wall, first = ("surface", "wall"), ("effect", 0)
        for scene, *parts in (
            (changed((), "sruface", {}), 'unknown key "sruface"', "surface"),
            (changed(("volume", "cavity"), "radius_mm", -1), "radius_mm = -1", "give a number"),
            (changed(("volume", "cavity"), "radius_mm", float("nan")), "radius_mm", "not a number"),
            (changed(("volume", "cavity"), "radius_mm", "wide"), "radius_mm", "a string"),
            (changed(("loop",), "method", "adaptiv"), "adaptiv", "adaptive"),
            (changed(wall, "volume", "cavty"), "cavty", "cavity"),
            (changed(first, "surface", "wal"), "dict: effect[0]: ", "wal", "wall"),
            (changed(("effect", 1), "static", -1), "dict: effect[1]: ", "static = -1"),
            (changed((), "efect", []), 'unknown key "efect"'),
            (changed((), "effect", 3), "effect", "[[effect]]"),
            (changed((), "loop", None), "loop is None", "leave the key out"),
            (changed(wall, "volume", object()), "surface.wall.volume", "of type object"),
            (changed(("loop",), "sub_steps", 2**70), "loop.sub_steps", "64 bits"),
            (changed(("loop",), 3, 4), "no string"),
            (changed(wall, "volume", "\ud800"), "no text"),
        ):
            with self.subTest(parts[0]):
                line = self.line_of(palpate.SceneError, lambda s=scene: palpate.Scene(s), *parts)
                self.assertTrue(line.startswith("dict: "), line)

    def test_a_dict_without_end_is_refused(self):
        endless = {}
        endless["a"] = endless
        self.line_of(palpate.SceneError, lambda: palpate.Scene({"loop": endless}), "too deep")

    def test_what_is_no_scene_is_a_type_error(self):
        for source in (None, 3, [1], b"x"):
            with self.assertRaises(TypeError):
                palpate.Scene(source)

    def test_what_is_given_for_a_scene_is_a_type_error(self):
        for call in (palpate.trace, palpate.study, palpate.Loop):
            with self.assertRaisesRegex(TypeError, "give a palpate.Scene"):
                call("cavity.toml")

    def test_random_dicts_are_refused_with_a_line_or_felt_within_the_limits(self):
        random = np.random.default_rng(16)
        absurd = (
            *(None, True, "", "wall", "cavity", [], {}, [1, 2, 3], {"a": 1}, object(), "\0"),
            *(0, -1, 1, 7, 1e-320, 1e308, np.inf, -np.inf, np.nan, 2**63 - 1, -(2**64), 1e6, 1e-3),
        )
        path, outcomes = strokes(50) * 1.03, {"refused": 0, "felt": 0}
        for _ in range(2000):
            scene = cavity()
            tables = [scene, *scene["effect"], scene["loop"]]
            tables += [scene["volume"]["cavity"], scene["surface"]["wall"]]
            for _ in range(random.integers(1, 3)):
                table = tables[random.integers(len(tables))]
                numbers = [key for key, value in table.items() if isinstance(value, (int, float))]
                if numbers and random.random() < 0.8:
                    table[random.choice(numbers)] *= 10.0 ** random.uniform(-1.0, 1.0)
                else:
                    key = random.choice([*table, "strength_n", "force_n", "contact", "x"])
                    table[key] = absurd[random.integers(len(absurd))]
            try:
                forces = palpate.trace(palpate.Scene(scene), path).force_n
            except palpate.SceneError as error:
                outcomes["refused"] += 1
                self.assertTrue(str(error).startswith("dict: "), error)
                self.assertRegex(str(error), "^[^\n]*; [^\n]*$")
            except palpate.ArgumentError as error:  # a rate that is not the path's
                self.fail(f"{scene}: {error}")
            else:
                outcomes["felt"] += 1
                self.assertTrue(np.isfinite(forces).all())
                self.assertLessEqual(np.linalg.norm(forces, axis=1).max(), 5.0)
        self.assertGreater(outcomes["refused"], 500)
        self.assertGreater(outcomes["felt"], 100)

    def test_a_file_is_refused_with_the_line_of_the_command(self):
        texts = {
            "key": CAVITY_TOML + "[lop]\n",
            "value": CAVITY_TOML.replace("radius_mm = 50", "radius_mm = 0"),
            "syntax": CAVITY_TOML + "= 3\n",
            "missing": CAVITY_TOML + '[volume.head]\nfile = "none.nrrd"\n',
        }
        with tempfile.TemporaryDirectory() as folder:
            for name, text in texts.items():
                file = Path(folder) / f"{name}.toml"
                file.write_text(text)
                said = run_command("explain", file, cwd=folder)
                self.assertEqual(said.returncode, 3)
                line = self.line_of(palpate.SceneError, lambda f=file: palpate.Scene(f), str(file))
                self.assertEqual(f"palpate: {line}\n", said.stderr)

    def test_files_that_cannot_be_read_or_written_are_file_errors(self):
        scene = palpate.Scene(cavity())
        trace = palpate.trace(scene, strokes(10))
        with tempfile.TemporaryDirectory() as folder:
            there = Path(folder) / "there.txt"
            there.write_text("not ours\n")
            none = Path(folder) / "none"
            for call in (
                lambda: palpate.Scene(none),
                lambda: palpate.Scene(folder),
                lambda: palpate.read_recording(none),
                lambda: palpate.read_recording(there),
                lambda: palpate.replay(there),
                lambda: palpate.read_mesh(none),
                lambda: palpate.read_mesh(there),
                lambda: palpate.trace(scene, none),
                lambda: palpate.trace(scene, there),
                lambda: trace.save(none / "recording.h5"),
                lambda: trace.save(there),
            ):
                self.line_of(palpate.FileError, call, folder)
            self.assertEqual(there.read_text(), "not ours\n")
            trace.save(there, force=True)
            self.assertEqual(len(palpate.read_recording(there)), 10)
            no_text = folder + os.fsdecode(b"/\xff")
            self.line_of(palpate.FileError, lambda: palpate.Scene(no_text), folder)

    def test_arguments_are_refused_with_what_to_give(self):
        scene = palpate.Scene(cavity())
        path = strokes(10)
        for call, *parts in (
            (lambda: palpate.trace(scene, path[:, :2]), "shape (10, 2)", "(N, 3)"),
            (lambda: palpate.trace(scene, path[0]), "shape (3,)", "(N, 3)"),
            (lambda: palpate.trace(scene, [["a", "b", "c"]]), "type <U1", "(N, 3)"),
            (lambda: palpate.trace(scene, [[1, 2, 3], [1]]), "(N, 3)"),
            (lambda: palpate.trace(scene, path + 1j), "complex", "(N, 3)"),
            (lambda: palpate.trace(scene, np.empty((0, 3))), "no rows", "a row per frame"),
            (lambda: palpate.trace(scene, path, rate_hz=0), "rate_hz = 0", "> 0"),
            (lambda: palpate.trace(scene, path, rate_hz=500), "path[1]", "resample"),
            (lambda: palpate.trace(scene, path, every=0), "every = 0", ">= 1"),
            (lambda: palpate.trace(scene, "x.csv", rate_hz=1000), "rate_hz", "leave it out"),
            (lambda: palpate.trace(scene, path, method="best"), "method best", "adaptive"),
            (lambda: palpate.trace(scene, path, sub_steps=4), "sub_steps", "method fixed"),
            (lambda: palpate.Loop(scene, tolerance_um=-1), "tolerance_um -1", "between"),
            (lambda: palpate.Loop(scene).set_gain(2, 1), "effect = 2", "2 effects"),
            (lambda: palpate.Loop(scene).set_gain(-1, 1), "effect = -1"),
            (lambda: palpate.Loop(scene).set_gain(0, 11), "gain = 11", "[0, 10]"),
            (lambda: palpate.Loop(scene).set_gain(0, float("nan")), "gain = nan"),
            (lambda: palpate.Loop(scene).frame([1, 2]), "position = [1, 2]", "three numbers"),
            (lambda: palpate.Loop(scene).frame("abc"), "three numbers"),
            (lambda: palpate.Loop(scene).frame(3), "three numbers"),
        ):
            line = self.line_of(palpate.ArgumentError, call, *parts)
            self.assertNotIn("--", line)

    def test_a_scene_without_a_path_says_so(self):
        scene = palpate.Scene(cavity())
        self.line_of(palpate.SceneError, lambda: palpate.trace(scene), "dict")
        self.line_of(palpate.SceneError, scene.path, "dict")

    def test_a_state_of_another_scene_is_refused(self):
        state = palpate.Loop(palpate.Scene(cavity())).save()
        other = palpate.Loop(palpate.Scene(cavity()))
        self.line_of(palpate.ArgumentError, lambda: other.restore(state))

    def test_a_column_that_there_is_not_names_those_there_are(self):
        trace = palpate.trace(palpate.Scene(cavity()), strokes(3))
        with self.assertRaisesRegex(KeyError, "proxy_x_m"):
            trace["proxy"]


if __name__ == "__main__":
    main()
