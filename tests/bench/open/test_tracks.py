# SPDX-License-Identifier: Apache-2.0
"""The frozen tracks are the same bytes everywhere, and others with another seed."""

import json
import os
import pathlib
import re
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
from files import read_mesh

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

    def test_what_it_cannot_read_or_write_is_one_line(self):
        nowhere = self.out / "nowhere"
        (self.out / "a_file").write_text("words")
        readme = OPEN.parents[1] / "README.md"
        for words, said in (
            (["/proc/foo", "--track", "plate"], "/proc/foo: cannot be made a folder ("),
            ([self.out / "a_file", "--track", "plate"], "a_file: cannot be made a folder ("),
            ([self.out / "o", "--track", "plate", "--check", nowhere], "nowhere: cannot be read (No such file"),
            ([self.out / "o", "--track", "plate", "--check", readme], "README.md:1: is no manifest of tracks; give one"),
            ([self.out / "o", "--track", "skull"], "--track skull: needs its data; get it with"),
            ([self.out / "o", "--skull", nowhere], "nowhere/skull.raw: is not there; get it with "
             f"scripts/fetch_data.sh {nowhere} skull"),
        ):  # fmt: skip
            done = run(OPEN / "tracks.py", *words)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1), done.stderr)
            self.assertIn(f"tracks.py: {said}" if said[0] in "/-" else said, done.stderr)
        self.assertFalse((self.out / "o").exists())  # nothing is written before

    def test_every_option_says_what_it_is_for(self):
        for program in ("tracks.py", "score.py", "enter_palpate.py"):
            text = run(OPEN / program, "--help").stdout
            for option in re.findall(r"^  (-\S.*|[A-Z]\S*)$", text, re.MULTILINE):
                after = text.split(f"\n  {option}\n", 1)[1]
                self.assertTrue("  " in option or after.startswith(" " * 20), (program, option))
        for part, program in (("rerun.py", "score.py"), ("truth.py", "score.py")):
            done = run(OPEN / part, "--help")
            self.assertEqual(done.returncode, 2)
            self.assertIn(f"is a part of {program} and no program", done.stderr)

    def test_without_numpy_it_says_which_package(self):
        for program in ("tracks.py", "score.py", "enter_palpate.py"):
            done = run(sys.executable, "-B", "-S", OPEN / program, "--help")  # -S: no packages
            self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1), done.stderr)
            self.assertIn("install it with: apt-get install python3-numpy", done.stderr)

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
        self.assert_closed_mesh(*read_mesh(file), outwards)

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
