# SPDX-License-Identifier: Apache-2.0
"""What is wrong becomes an exception with the line that the command prints."""

import os
import tempfile
import unittest
from pathlib import Path

import numpy as np
from support import CAVITY_TOML, cavity, main, run_command, strokes

import palpate


HEAD_TOML = """
[volume.head]
file = "head.nii"
[surface.bone]
volume = "head"
iso_value = 226
contact = "volume"
[[effect]]
type = "surface"
surface = "bone"
"""


def changed(table, key, value):
    """The cavity with another value."""
    scene = cavity()
    at = scene
    for part in table:
        at = at[part]
    at[key] = value
    return scene


# What no argument of any function is, but for a few.
ABSURD = (
    *(None, True, "x", "123", b"123", "a\0b", "\ud800", object(), {}, {1: 1, 2: 2, 3: 3}, {"x"}),
    *(0, -1, 2**40, 2**70, 1.5, 1e300, float("nan"), float("inf"), 1j, 2**2000),
    *([], [1, 2], [1, 2, 3], [[1, 2, 3]], [1, [2], 3], [None] * 3, ["1", "2", "3"], [1j, 1, 1]),
    *(np.empty(0), np.zeros((3, 3)), np.arange(3) + 1j, np.array(["1", "2", "3"])),
    *(np.array([1, "a", None], dtype=object), np.array([["1", "2", "3"]])),
    *(np.ma.masked_equal([1.0, 2.0, 3.0], 2.0), np.ma.masked_equal([[1.0, 2.0, 3.0]], 2.0)),
)


class Errors(unittest.TestCase):
    def line_of(self, kind, call, *parts):
        """The one line of an exception of this kind, which has these parts."""
        with self.assertRaises(kind) as caught:
            call()
        if kind is not TypeError:
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

    def test_lines_of_a_dict_are_counted_as_the_reader_counts_them(self):
        scene = changed(("effect", 1), "static", -1)
        scene["effect"][0]["a\u2028[[b"] = "c\u2028[[d"
        with self.assertRaisesRegex(palpate.SceneError, r"^dict: effect\[[01]\]: "):
            palpate.Scene(scene)

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

    def test_a_folder_whose_name_is_no_text_is_read(self):
        with tempfile.TemporaryDirectory() as folder:
            no_text = Path(folder) / os.fsdecode(b"daten_\xe4")
            no_text.mkdir()
            phantom = run_command("phantom", "head.nii", cwd=folder)
            self.assertEqual(phantom.returncode, 0, phantom.stderr)
            header = bytearray((Path(folder) / "head.nii").read_bytes())
            header[252:256] = bytes(4)  # neither form: that is warned of
            (no_text / "head.nii").write_bytes(header)
            (no_text / "scene.toml").write_text(HEAD_TOML)
            scene = palpate.Scene(str(no_text / "scene.toml"))
            self.assertTrue(any("states no orientation" in line for line in scene.warnings))
            self.assertIn("scene.toml", scene.explain())
            trace = palpate.trace(scene, strokes(10))
            recording = no_text / "recording.h5"
            trace.save(recording)
            read = palpate.read_recording(recording)
            self.assertTrue(os.fsencode(read.scene_file).endswith(b"daten_\xe4/scene.toml"))

    def test_arguments_are_refused_with_what_to_give(self):
        scene = palpate.Scene(cavity())
        path = strokes(10)
        rows = np.column_stack([np.arange(10) / 1000.0, path])
        for call, *parts in (
            (lambda: palpate.trace(scene, path[:, :2]), "shape (10, 2)", "(N, 3)"),
            (lambda: palpate.trace(scene, path[0]), "shape (3,)", "(N, 3)"),
            (lambda: palpate.trace(scene, [["a", "b", "c"]]), "type <U1", "(N, 3)"),
            (lambda: palpate.trace(scene, [[1, 2, 3], [1]]), "(N, 3)"),
            (lambda: palpate.trace(scene, path + 1j), "complex", "(N, 3)"),
            (lambda: palpate.trace(scene, np.empty((0, 3))), "no rows", "a row per frame"),
            (lambda: palpate.trace(scene, path, rate_hz=0), "rate_hz = 0", "> 0"),
            (lambda: palpate.trace(scene, path, rate_hz=500), "path[1]", "resample"),
            (lambda: palpate.trace(scene, path, every=0), "every = 0", "[1, 2147483647]"),
            (lambda: palpate.trace(scene, "x.csv", rate_hz=1000), "rate_hz", "leave it out"),
            (lambda: palpate.trace(scene, rows, rate_hz=1000), "rows have their t_s", "leave it out"),
            (lambda: palpate.trace(scene, path, method="best"), "method best", "adaptive"),
            (lambda: palpate.trace(scene, path, sub_steps=4), "sub_steps", "method fixed"),
            (lambda: palpate.Loop(scene, tolerance_um=-1), "tolerance_um -1", "(0, 1000]"),
            (lambda: palpate.Loop(scene).set_gain(2, 1), "effect = 2", "[0, 1]"),
            (lambda: palpate.Loop(scene).set_gain(-1, 1), "effect = -1"),
            (lambda: palpate.Loop(scene).set_gain(0, 11), "gain = 11", "[0, 10]"),
            (lambda: palpate.Loop(scene).set_gain(0, float("nan")), "gain = nan"),
            (lambda: palpate.Loop(scene).frame([1, 2]), "position = [1, 2]", "three numbers"),
            (lambda: palpate.Loop(scene).frame("abc"), "three numbers"),
            (lambda: palpate.Loop(scene).frame(3), "three numbers"),
        ):
            line = self.line_of(palpate.ArgumentError, call, *parts)
            self.assertNotIn("--", line)

    def test_texts_and_masked_numbers_are_no_vectors(self):
        loop = palpate.Loop(palpate.Scene(changed(("surface", "wall"), "moves", True)))
        distance = palpate.SurfaceDistance(palpate.Scene(cavity()), "wall")
        for wrong in ("123", b"123", ["1", "2", "3"], np.array(["1", "2", "3"]), [1j, 2, 3]):
            for name, call in (
                ("position", lambda w=wrong: loop.frame(w)),
                ("position", lambda w=wrong: loop.set_pose("wall", w)),
            ):
                self.line_of(palpate.ArgumentError, call, f"{name} = ", "; give ")
            self.line_of(palpate.ArgumentError, lambda w=wrong: distance.nearest([w]), "points")
        for wrong in ("1234", b"1234", ["1", "2", "3", "4"]):
            self.line_of(
                palpate.ArgumentError,
                lambda w=wrong: loop.set_pose("wall", [0, 0, 0], w),
                "orientation = ",
                "; give four numbers",
            )
        matrix = np.eye(4).astype(str)
        self.line_of(palpate.ArgumentError, lambda: palpate.affine_from_ras_mm(matrix), "affine: ")
        masked = np.ma.masked_equal([1.0, 2.0, 3.0], 2.0)
        for call in (
            lambda: loop.frame(masked),
            lambda: distance.nearest(np.ma.vstack([masked])),
            lambda: palpate.trace(palpate.Scene(cavity()), np.ma.vstack([masked])),
        ):
            self.line_of(palpate.ArgumentError, call, "is masked; give ", ".filled(")
        for right in ((0, 0, 0), np.zeros(3, np.float32), np.array([0, 0, 0], dtype=object)):
            self.assertEqual(loop.frame(right).probe_m.tolist(), [0.0, 0.0, 0.0])

    def test_a_pose_is_refused_for_one_reason(self):
        two = changed(("surface", "wall"), "moves", True)
        two["surface"]["rest"] = {"volume": "cavity"}
        two["effect"].append({"type": "surface", "surface": "rest"})
        loop = palpate.Loop(palpate.Scene(two))
        still = palpate.Loop(palpate.Scene(cavity()))
        empty = palpate.Loop(palpate.Scene({}))
        here, most = [0, 0, 0], "less than 1e6 m"
        for call, *parts in (
            (lambda: loop.set_pose("wal", here), "surface = 'wal'", "give one of rest, wall"),
            (lambda: loop.set_pose(2, here), "surface = 2", "give an integer in [0, 1]"),
            (lambda: loop.pose(-1), "surface = -1", "give an integer in [0, 1]"),
            (lambda: loop.wrench("wal"), "surface = 'wal'", "give one of rest, wall"),
            (
                lambda: loop.set_pose("rest", here),
                "surface = 'rest' does not move; ",
                "moves = true",
                "[surface.rest], or one that does: wall",
            ),
            (lambda: loop.set_pose(0, here), "surface = 0 does not move", "[surface.rest]"),
            (lambda: still.set_pose("wall", here), "'wall' does not move", "[surface.wall]"),
            (lambda: loop.set_pose("wall", [np.nan, 0, 0]), "position = [nan, 0, 0] is out", most),
            (lambda: loop.set_pose("wall", [0, np.inf, 0]), "position = [0, inf, 0] is out", most),
            (lambda: loop.set_pose("wall", [0, 0, 2e6]), "position = [0, 0, 2000000.0] is", most),
            (lambda: loop.set_pose("wall", [0, 0]), "position = [0, 0]", "three numbers in m"),
            (lambda: loop.set_pose("wall", here, [0] * 4), "orientation = [0, 0, 0, 0] has no"),
            (lambda: loop.set_pose("wall", here, [np.nan] * 4), "orientation = [nan, nan, "),
            (lambda: loop.set_pose("wall", here, here), "orientation = [0, 0, 0]", "four numbers"),
            (lambda: empty.set_pose("wall", here), "surface = 'wall': the scene lets none"),
            (lambda: empty.set_pose(0, here), "surface = 0: the scene lets none be felt; add an"),
            (lambda: empty.set_gain(0, 1), "effect = 0: the scene has none; add one"),
        ):
            line = self.line_of(palpate.ArgumentError, call, *parts)
            self.assertEqual(line.count("; "), 1, line)
        for wrong in (None, 1.5, b"wall"):
            self.line_of(TypeError, lambda w=wrong: loop.pose(w), f"surface = {wrong!r} is", "wall")
        loop.set_pose("wall", [0, 0, 0.9e6], [0, 0, 0, 1e-9])

    def test_a_surface_that_is_not_felt_is_told_with_those_that_are(self):
        scene, empty = palpate.Scene(cavity()), palpate.Scene({})
        distance = palpate.SurfaceDistance
        self.line_of(palpate.ArgumentError, lambda: distance(scene, "x"), "give one of: wall")
        self.line_of(
            palpate.ArgumentError, lambda: distance(empty, "x"), "; there are none: add an effect"
        )
        self.line_of(TypeError, lambda: distance(scene, 0), "surface = 0 is of type int; give")
        with self.assertRaisesRegex(KeyError, "no surface 'x' is felt; there are wall"):
            scene.mesh("x")
        with self.assertRaisesRegex(KeyError, "no surface None is felt; there are none"):
            empty.mesh(None)

    def test_what_is_as_good_is_taken(self):
        scene = palpate.Scene(cavity())
        loop = palpate.Loop(scene)
        loop.set_gain(0, np.bool_(True))
        loop.frame([0, 0, 0], new_trial=np.array(True))
        loop.frame(np.zeros(3, np.float32), np.float64(1.0))

    def test_flags_are_32_bits(self):
        self.assertEqual(palpate.flag_names(0), [])
        self.assertEqual(palpate.flag_names(np.uint32(1)), palpate.flag_names(1))
        palpate.flag_names(2**32 - 1)
        self.assertEqual(palpate.flag_names(np.float64(1.0)), palpate.flag_names(1))
        for wrong in (-1, 2**32, 2**40):
            parts = f"flags = {wrong} is out of range", "give an integer in [0, 4294967295]"
            self.line_of(palpate.ArgumentError, lambda w=wrong: palpate.flag_names(w), *parts)
        for wrong in (1.5, "1", None, [1]):
            parts = f"flags = {wrong!r} is of type", "give an integer in [0, 4294967295]"
            self.line_of(TypeError, lambda w=wrong: palpate.flag_names(w), *parts)

    def test_absurd_arguments_are_refused_with_a_line(self):
        scene = palpate.Scene(changed(("surface", "wall"), "moves", True))
        loop, distance = palpate.Loop(scene), palpate.SurfaceDistance(scene, "wall")
        path, zero = strokes(3), [0, 0, 0]
        trace, labels = palpate.trace(scene, path), np.ones((2, 2, 2), np.int32, "F")
        unit = {"scan": "a", "structure": "b", "scene": cavity()}
        calls = {
            "flag_names": palpate.flag_names,
            "frame": loop.frame,
            "frame, time_s": lambda a: loop.frame(zero, a),
            "frame, new_trial": lambda a: loop.frame(zero, new_trial=a),
            "set_pose": lambda a: loop.set_pose(a, zero),
            "set_pose, position": lambda a: loop.set_pose(0, a),
            "set_pose, orientation": lambda a: loop.set_pose(0, zero, a),
            "pose": loop.pose,
            "wrench": loop.wrench,
            "set_gain": lambda a: loop.set_gain(a, 1),
            "set_gain, gain": lambda a: loop.set_gain(0, a),
            "adopt": loop.adopt,
            "restore": loop.restore,
            "Loop": palpate.Loop,
            "Loop, method": lambda a: palpate.Loop(scene, method=a),
            "Loop, sub_steps": lambda a: palpate.Loop(scene, method="fixed", sub_steps=a),
            "Loop, tolerance_um": lambda a: palpate.Loop(scene, tolerance_um=a),
            "Loop, budget_us": lambda a: palpate.Loop(scene, method="paper", budget_us=a),
            "SurfaceDistance": lambda a: palpate.SurfaceDistance(scene, a),
            "nearest": distance.nearest,
            "Scene": palpate.Scene,
            "Scene, cache": lambda a: palpate.Scene(cavity(), cache=a),
            "Scene, extraction": lambda a: palpate.Scene(cavity(), extraction=a),
            "from_text": palpate.Scene.from_text,
            "from_text, file": lambda a: palpate.Scene.from_text("", file=a),
            "mesh": scene.mesh,
            "path": lambda a: scene.path(every=a),
            "trace": lambda a: palpate.trace(a, path),
            "trace, path": lambda a: palpate.trace(scene, a),
            "trace, rate_hz": lambda a: palpate.trace(scene, path, rate_hz=a),
            "trace, every": lambda a: palpate.trace(scene, path, every=a),
            "trace, method": lambda a: palpate.trace(scene, path, method=a),
            "study": lambda a: palpate.study(a, path),
            "replay": palpate.replay,
            "replay, scene": lambda a: palpate.replay("none.h5", a),
            "read_recording": palpate.read_recording,
            "read_mesh": palpate.read_mesh,
            "save": trace.save,
            "save, force": lambda a: trace.save("none/none.h5", force=a),
            "column": trace.__getitem__,
            "affine_from_ras_mm": palpate.affine_from_ras_mm,
            "Voxels": lambda a: palpate.Voxels(a, np.eye(4)),
            "Vectors": lambda a: palpate.Vectors(a, np.eye(4)),
            "Labels": lambda a: palpate.Labels(a, np.eye(4)),
            "Labels, names": lambda a: palpate.Labels(labels, 1e-3 * np.eye(4), a),
            "Labels, names of layers": lambda a: palpate.Labels([labels] * 2, np.eye(4), a),
            "Labels, name": lambda a: palpate.Labels(labels, np.eye(4), {1: a}),
            "volume": lambda a: palpate.Scene(changed(("volume",), "cavity", a)),
            "file": lambda a: palpate.Scene({"volume": {"scan": {"file": a}}}),
            "mesh of a surface": lambda a: palpate.Scene({"surface": {"gem": {"mesh": a}}}),
            "Mesh": lambda a: palpate.Scene({"surface": {"a": {"mesh": palpate.Mesh(a, a)}}}),
            "study_many": lambda a: palpate.study_many(a, out="none"),
            "study_many, client": lambda a: palpate.study_many([unit], a, out="none"),
            "study_unit": lambda a: palpate.study_unit([unit], a, out="none"),
            "merge_studies": lambda a: palpate.merge_studies(a, out="none"),
            "merge_studies, out": lambda a: palpate.merge_studies([unit], out=a),
        }
        before, refused = os.getcwd(), 0
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            self.addCleanup(os.chdir, before)
            for name, call in calls.items():
                for absurd in ABSURD:
                    with self.subTest(name, value=repr(absurd)[:40]):
                        try:
                            call(absurd)
                        except (palpate.Error, TypeError, KeyError) as error:
                            refused += 1
                            line = str(error)
                            self.assertNotIn("\n", line)
                            self.assertRegex(line, "; |must be")
                            self.assertLess(len(line), 1000)
        self.assertGreater(refused, 0.8 * len(calls) * len(ABSURD))

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

    def test_names_with_line_ends_make_one_line(self):
        scene = palpate.Scene(cavity())
        for call in (
            lambda: palpate.Loop(scene, method="a\nb"),
            lambda: scene.of_hand("a\rb"),
            lambda: palpate.SurfaceDistance(scene, "a\nb"),
        ):
            with self.assertRaises(palpate.ArgumentError) as caught:
                call()
            self.assertEqual(len(str(caught.exception).splitlines()), 1)


if __name__ == "__main__":
    main()
