# SPDX-License-Identifier: Apache-2.0
"""The frozen tracks are the same bytes everywhere, and others with another seed."""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import support
from support import OPEN, SKULL, run

import exact
import shapes
import tracks
from closest import load_mesh

MANIFEST = tracks.MANIFEST


class Tracks(unittest.TestCase):
    def setUp(self):
        self._folder = tempfile.TemporaryDirectory()
        self.out = pathlib.Path(self._folder.name)
        self.addCleanup(self._folder.cleanup)

    def test_hashes_are_those_of_the_manifest(self):
        done = run(OPEN / "tracks.py", self.out, "--check", MANIFEST)
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertIn("all hashes are those of the manifest", done.stdout)
        self.assertIn("skull: left out", done.stderr)
        written = json.loads((self.out / "manifest.json").read_text())
        frozen = json.loads(MANIFEST.read_text())
        self.assertEqual(set(written["tracks"]) | {"skull"}, set(frozen["tracks"]))

    def test_hashes_do_not_depend_on_the_processor(self):
        # numpy has other code for processors without these; its sines differ, ours may not.
        less = dict(os.environ, NPY_DISABLE_CPU_FEATURES="AVX2 FMA3 AVX512F AVX512_SKX")
        words = [sys.executable, OPEN / "tracks.py", self.out, "--track", "bumps", "sphere_20k"]
        done = subprocess.run([*words, "--check", MANIFEST], env=less, capture_output=True,
                              text=True, check=False)  # fmt: skip
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    @unittest.skipUnless((SKULL / "skull.raw").is_file(), "scripts/fetch_data.sh got no skull")
    def test_the_skull_is_that_of_the_manifest(self):
        done = run(OPEN / "tracks.py", self.out, "--track", "skull", "--skull", SKULL,
                   "--check", MANIFEST)  # fmt: skip
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assert_closed(self.out / "skull" / "mesh.obj", outwards=True)

    def test_another_seed_gives_other_tracks(self):
        entries = tracks.write_tracks(self.out, 7, ["sphere", "plate", "sphere_20k"])
        frozen = json.loads(MANIFEST.read_text())
        wrong = list(tracks.differences(entries, frozen))
        files = sum(len(e["sha256"]) for e in entries.values())
        self.assertGreater(len(wrong), files - 2)  # two shapes may be the same word

    def test_tracks_that_were_written_before_stay_in_the_manifest(self):
        tracks.write_tracks(self.out, 1, ["plate"])
        tracks.write_tracks(self.out, 1, ["wedge"])
        written = json.loads((self.out / "manifest.json").read_text())["tracks"]
        self.assertEqual(set(written), {"plate", "wedge"})
        self.assertTrue(tracks.is_frozen(self.out / "plate"))
        tracks.write_tracks(self.out, 2, ["wedge"])  # of another seed they are other tracks
        written = json.loads((self.out / "manifest.json").read_text())["tracks"]
        self.assertEqual(set(written), {"wedge"})
        self.assertFalse(tracks.is_frozen(self.out / "wedge"))

    def test_a_changed_hash_is_told(self):
        manifest = json.loads(MANIFEST.read_text())
        manifest["tracks"]["plate"]["sha256"]["path.csv"] = "0" * 64
        changed = self.out / "changed.json"
        changed.write_text(json.dumps(manifest))
        done = run(OPEN / "tracks.py", self.out, "--track", "plate", "--check", changed)
        self.assertEqual(done.returncode, 1)
        self.assertIn("plate/path.csv: SHA-256 is ", done.stdout)

    def test_meshes_are_closed_and_seen_from_free_space(self):
        names = ["sphere_20k", "plate", "wedge", "grooves"]
        tracks.write_tracks(self.out, 3, names)
        for name in names:
            self.assert_closed(self.out / name / "mesh.obj", outwards=name != "sphere_20k")

    def test_a_level_of_voxels_is_closed(self):
        index = np.stack(np.indices((12, 13, 14)), axis=-1)
        ball = 40 - np.rint(((index - 6.3) ** 2).sum(axis=3)).astype(int)
        ball[4:7, 4:7, 4:7] = -5  # with a hole in it, and flat sides
        points, triangles = shapes.level_of(np.pad(ball, 1, constant_values=-9), 4.5)
        self.assert_closed_mesh(points, triangles, True)

    def assert_closed(self, file, outwards):
        self.assert_closed_mesh(*load_mesh(file), outwards)

    def assert_closed_mesh(self, points, triangles, outwards):
        ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
        forth = {tuple(e) for e in ends.tolist()}
        self.assertEqual(len(forth), len(ends))  # no edge twice in one direction
        self.assertEqual(forth, {(b, a) for a, b in forth})
        a, b, c = (points[triangles[:, i]] for i in range(3))
        volume = (np.cross(a, b) * c).sum() / 6
        self.assertGreater(volume if outwards else -volume, 0)


class Exact(unittest.TestCase):
    def test_sines_are_within_a_few_roundings(self):
        turns = np.linspace(-3, 3, 10001)
        # The argument of numpy's own is rounded: 2 pi 3 times 1.1e-16.
        error = np.abs(exact.sine(turns) - np.sin(2 * np.pi * turns)).max()
        self.assertLess(error, 5e-15)
        error = np.abs(exact.cosine(turns) - np.cos(2 * np.pi * turns)).max()
        self.assertLess(error, 5e-15)

    def test_streams_of_seeds_and_names_differ_and_repeat(self):
        drawn = [exact.Random(s, n).uniform(0, 1) for s in (1, 2) for n in ("plate", "wedge")]
        self.assertEqual(len(set(drawn)), 4)
        self.assertEqual(drawn[0], exact.Random(1, "plate").uniform(0, 1))
        axes = exact.Random(5, "any").axes()
        self.assertLess(np.abs(axes @ axes.T - np.eye(3)).max(), 1e-14)


if __name__ == "__main__":
    support.main()
