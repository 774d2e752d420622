# SPDX-License-Identifier: Apache-2.0
"""Scenes from a dict, from text and from a file are one."""

import os
import tempfile
import tomllib
import unittest
from pathlib import Path, PurePosixPath

import numpy as np
from support import (
    CAVITY_TOML,
    ROOT,
    cavity,
    main,
    run_command,
    run_python,
    strokes,
    write_path,
)

import palpate
from palpate import _toml

EXAMPLES = ROOT / "examples"
_BROKEN = """
import sys
from pathlib import Path
import palpate
(Path(sys.argv[1]) / "_extraction.so").write_bytes(b"not a library")
palpate.__path__.insert(0, sys.argv[1])
try:
    palpate.Scene({})
except palpate.SceneError as error:
    print(error)
"""


class Scenes(unittest.TestCase):
    def test_a_dict_and_its_toml_and_its_file_feel_the_same(self):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "cavity.toml"
            file.write_text(CAVITY_TOML)
            scenes = [
                palpate.Scene(cavity()),
                palpate.Scene.from_text(CAVITY_TOML),
                palpate.Scene(file),
                palpate.Scene(str(file)),
            ]
        forces = [palpate.trace(scene, strokes(3000)).force_n for scene in scenes]
        self.assertGreater(np.abs(forces[0]).max(), 0.5)
        for other in forces[1:]:
            self.assertEqual(forces[0].tobytes(), other.tobytes())
        self.assertEqual([scene.name for scene in scenes], ["dict", "text", "cavity", "cavity"])

    def test_a_scene_stays_where_its_files_are(self):
        here = os.getcwd()
        self.addCleanup(os.chdir, here)
        with tempfile.TemporaryDirectory() as folder:
            ours, other = Path(folder, "ours"), Path(folder, "other")
            for place, count in ((ours, 50), (other, 20)):
                place.mkdir()
                write_path(place / "path.csv", strokes(count))
            text = CAVITY_TOML + '[device]\ntype = "path"\nfile = "path.csv"\n'
            (ours / "scene.toml").write_text(text)
            os.chdir(ours)
            device = {"type": "path", "file": "path.csv"}
            scenes = [
                palpate.Scene("scene.toml"),
                palpate.Scene({**cavity(), "device": device}),
                palpate.Scene.from_text(text),
            ]
            os.chdir(other)
            for scene in scenes:
                self.assertEqual(len(palpate.trace(scene)), 50)
            trace = palpate.trace(scenes[0])
            with self.assertRaisesRegex(palpate.FileError, "would be replaced"):
                trace.save(ours / "scene.toml", force=True)
            trace.save("recording.h5")
            read = palpate.read_recording("recording.h5")
            self.assertTrue(os.path.samefile(read.scene_file, ours / "scene.toml"))
            with self.assertRaisesRegex(palpate.FileError, "^none.toml: "):
                palpate.Scene("none.toml")
            with self.assertRaisesRegex(palpate.SceneError, "^dict: "):
                palpate.trace(palpate.Scene(cavity()))
            gone = Path(folder, "gone")
            gone.mkdir()
            os.chdir(gone)
            gone.rmdir()
            self.assertEqual(len(palpate.trace(palpate.Scene(cavity()), strokes(10))), 10)
            os.chdir(here)

    def test_an_extraction_that_cannot_be_loaded_is_told(self):
        with tempfile.TemporaryDirectory() as folder:
            said = run_python(_BROKEN, folder)
        self.assertRegex(said.stdout, "is there and cannot be loaded .*; install", said.stderr)

    def test_a_dict_keeps_its_values_in_the_text(self):
        hard = {
            "volume": {'with "quotes"': {"a": 0.1 + 0.2, "b": -0.0, "c": float("inf")}},
            "effect": [{"points": [[0.0, 1e-300], [1, 2]]}, {"name": "tab\there \x7f é \\ ü"}],
            "loop": {"on": True, "off": False, "many": 2**63 - 1, "inline": {"x": {"y": 1}}},
            "empty": {},
        }
        back = tomllib.loads(_toml.scene_text(hard))
        self.assertEqual(back, hard)
        self.assertEqual(np.signbit(back["volume"]['with "quotes"']["b"]), True)

    def test_every_example_comes_back_from_its_own_dict(self):
        files = sorted(EXAMPLES.glob("*.toml"))
        self.assertGreater(len(files), 5)
        for file in files:
            tables = tomllib.loads(file.read_text())
            with self.subTest(file.name):
                self.assertEqual(tomllib.loads(_toml.scene_text(tables)), tables)

    def test_numbers_and_paths_of_numpy_and_pathlib_are_values(self):
        scene = cavity()
        scene["volume"]["cavity"]["radius_mm"] = np.float32(50)
        scene["loop"]["sub_steps"] = np.int64(4)
        self.assertEqual(palpate.Scene(scene).description["loop"]["sub_steps"], 4)
        self.assertEqual(tomllib.loads(_toml.scene_text({"a": PurePosixPath("b/c")})), {"a": "b/c"})
        self.assertEqual(tomllib.loads(_toml.scene_text({"a": np.eye(2)}))["a"], [[1, 0], [0, 1]])

    def test_a_file_with_a_byte_order_mark_is_described(self):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "marked.toml"
            file.write_text("\ufeff" + _toml.scene_text(cavity()), encoding="utf-8")
            self.assertEqual(palpate.Scene(file).description, cavity())

    def test_a_scene_says_what_it_is(self):
        scene = palpate.Scene(cavity(method="fixed"))
        self.assertEqual(scene.surfaces, ["wall"])
        self.assertEqual(scene.effects, ["surface", "friction"])
        self.assertEqual(scene.method, "fixed")
        self.assertEqual(scene.rate_hz, 1000.0)
        self.assertEqual(scene.warnings, [])
        self.assertEqual(scene.description, cavity(method="fixed"))
        self.assertIsNone(scene.mesh("wall"))
        with self.assertRaises(KeyError):
            scene.mesh("floor")

    def test_it_explains_itself_as_the_command_does(self):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "cavity.toml"
            file.write_text(CAVITY_TOML)
            said = run_command("explain", file, cwd=folder)
            self.assertEqual(said.returncode, 0, said.stderr)
            scene = palpate.Scene(file)

            def without_prices(words):  # measured anew each time
                return [
                    [word for word in line.split() if not word.replace(".", "").isdigit()]
                    for line in words.splitlines()
                ]

            self.assertEqual(without_prices(scene.explain()), without_prices(said.stdout))
            self.assertEqual([e["type"] for e in scene.plan()["effects"]], scene.effects)

    def test_warnings_are_those_of_the_command(self):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "strong.toml"
            push = '[[effect]]\ntype = "constant_force"\nforce_n = [9, 0, 0]\n'
            file.write_text(CAVITY_TOML + push + '[device]\ntype = "orbit"\nduration_s = 0.5\n')
            said = run_command("trace", file, "--frames", 10, cwd=folder)
            self.assertEqual(said.returncode, 0, said.stderr)
            warnings = palpate.Scene(file).warnings
            self.assertGreater(len(warnings), 0)
            for warning in warnings:
                self.assertIn(f"palpate: warning: {warning}\n", said.stderr)

    def test_a_mesh_is_vertices_and_triangles(self):
        corners = [(0, 0, 0), (10, 0, 0), (0, 10, 0), (0, 0, 10)]
        faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "tetrahedron.obj"
            lines = ["# SPACE=LPS UNIT=mm"]
            lines += [f"v {x} {y} {z}" for x, y, z in corners]
            lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
            file.write_text("\n".join(lines) + "\n")
            read = palpate.read_mesh(file)
            scene = palpate.Scene(
                {
                    "surface": {"bone": {"mesh": str(file)}},
                    "effect": [{"type": "surface", "surface": "bone"}],
                }
            )
        felt = scene.mesh("bone")
        for vertices, triangles in (read, felt):
            np.testing.assert_allclose(vertices, np.array(corners) * 1e-3, rtol=1e-15)
            self.assertEqual(triangles.tolist(), [list(face) for face in faces])
        self.assertEqual(read.faces().tolist()[:4], [3, 0, 2, 1])
        self.assertEqual(len(read.faces()), 16)


if __name__ == "__main__":
    main()
