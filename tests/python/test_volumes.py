# SPDX-License-Identifier: Apache-2.0
"""Volumes from files: baked, made meshes of, kept in a cache, as by the command."""

import importlib.util
import tempfile
import unittest
from pathlib import Path

import numpy as np
from support import main, run_command

import palpate

SCENE = """
[volume.head]
file = "phantom.nrrd"
[surface.bone]
volume = "head"
iso_value = 226.0
smooth_voxels = 0.7
[[effect]]
type = "surface"
surface = "bone"
[device]
type = "orbit"
duration_s = 1.0
"""
CAN_EXTRACT = importlib.util.find_spec("palpate._extraction") is not None


class Volumes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)
        cls.file = cls.folder / "phantom.toml"
        cls.file.write_text(SCENE)
        said = run_command("phantom", "phantom.nrrd", cwd=cls.folder)
        assert said.returncode == 0, said.stderr
        said = run_command("trace", cls.file, "--out", "out", cwd=cls.folder)
        assert said.returncode == 0, said.stderr
        cls.recording = palpate.read_recording(cls.folder / "out" / "recording.h5")
        cls.cache = cls.folder / "cache"  # the command's

    def assert_same_frames(self, trace):
        for name in ("force_x_n", "proxy_y_m", "residual_m", "evaluations", "flags", "felt"):
            np.testing.assert_array_equal(trace[name], self.recording[name], name)

    def test_the_command_and_we_feel_the_same_and_share_a_cache(self):
        kept = sorted(self.cache.iterdir())
        self.assertGreater(len(kept), 0)
        before = [file.stat().st_mtime_ns for file in kept]
        scene = palpate.Scene(self.file, cache=self.cache)
        self.assertGreater((self.recording["felt"] == "bone").sum(), 500)
        self.assert_same_frames(palpate.trace(scene))
        self.assert_same_frames(palpate.replay(self.recording, cache=self.cache))
        self.assertEqual(sorted(self.cache.iterdir()), kept)
        self.assertEqual([file.stat().st_mtime_ns for file in kept], before)

    def test_without_a_cache_the_same_is_felt_and_nothing_is_written(self):
        before = sorted(self.folder.rglob("*"))
        self.assert_same_frames(palpate.trace(palpate.Scene(self.file)))
        self.assertEqual(sorted(self.folder.rglob("*")), before)

    @unittest.skipUnless(CAN_EXTRACT, "built without CGAL")
    def test_a_mesh_is_closed_and_lies_on_the_surface(self):
        scene = palpate.Scene(self.file, cache=self.cache)
        vertices, triangles = scene.mesh("bone")
        self.assertEqual(triangles.max() + 1, len(vertices))
        edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        _, times = np.unique(edges, axis=0, return_counts=True)
        self.assertEqual(set(times), {2})
        contact = self.recording.proxy_m[self.recording["felt"] == "bone"][::50]
        nearest = [np.linalg.norm(vertices - point, axis=1).min() for point in contact]
        self.assertLess(max(nearest), 3e-3)  # its facets have 2 mm

    @unittest.skipUnless(CAN_EXTRACT, "built without CGAL")
    def test_without_extraction_the_volume_alone_is_felt(self):
        scene = palpate.Scene(self.file, extraction=False)
        self.assertIsNone(scene.mesh("bone"))
        trace = palpate.trace(scene)
        self.assertGreater((trace["felt"] == "bone").sum(), 500)

    def test_a_damaged_volume_is_the_scenes_error_and_names_its_file(self):
        damaged = self.folder / "damaged"
        damaged.mkdir()
        whole = (self.folder / "phantom.nrrd").read_bytes()
        (damaged / "phantom.nrrd").write_bytes(whole[: len(whole) // 2])
        with self.assertRaisesRegex(palpate.SceneError, "phantom.nrrd.*; "):
            palpate.Scene.from_text(SCENE, file=damaged / "scene.toml")


if __name__ == "__main__":
    main()
