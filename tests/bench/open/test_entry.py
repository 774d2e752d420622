# SPDX-License-Identifier: Apache-2.0
"""Entrants enter: Palpate within its certificate, the plain god object, and another engine."""

import csv
import json
import os
import shutil
import subprocess
import unittest

import support
from support import GOD_OBJECT, OPEN, PALPATE, ROUNDED_UM, ROOT, WithTracks, run

from score import Track, score

STUB = ROOT / "tests" / "bench" / "open" / "chai3d_stub"
TOLERANCE_UM = 0.1  # of method adaptive: what a frame's last step may leave (docs/scenes.md)
CERTIFICATE_UM = 25.0  # a chord of contact volume goes no deeper (docs/contact.md 1.6)


class Entry(WithTracks):
    TRACKS = ["sphere", "plate", "wedge", "grooves"]

    def scored(self, track, *words):
        file = self.folder / "answer.csv"
        done = run(*words, self.tracks / track, file)
        self.assertEqual(done.returncode, 0, done.stderr)
        return score(Track(self.tracks / track), file)

    @unittest.skipUnless(PALPATE, "OPEN_PALPATE is not set")
    def test_palpate_is_within_its_certificate(self):
        found = self.scored("sphere", PALPATE, "adaptive:volume")
        self.assertLess(found["level_max_um"], TOLERANCE_UM)
        self.assertLess(found["deepest_um"], CERTIFICATE_UM)
        self.assertEqual(found["fell_through_frames"] + found["lost_frames"], 0)
        self.assertEqual(found["force_jumps"] + found["ghost_frames"], 0)

    @unittest.skipUnless(PALPATE, "OPEN_PALPATE is not set")
    def test_palpate_on_a_mesh_is_where_the_descent_ends(self):
        # Corners of the mesh are rounded to 1e-9 m, and a facet of 2 mm that is tilted by that
        # leads a probe 3 mm behind it 3 nm astray: 0.003 um, and as much from its neighbour.
        for track in ("plate", "wedge", "grooves"):
            found = self.scored(track, PALPATE, "adaptive:mesh")
            self.assertLess(found["level_max_um"], 0.002 + ROUNDED_UM, track)
            self.assertLess(found["position_max_um"], 0.006 + ROUNDED_UM, track)

    @unittest.skipUnless(PALPATE, "OPEN_PALPATE is not set")
    def test_a_contact_that_does_not_apply_is_left_out(self):
        for what, track in (("adaptive:mesh", "sphere"), ("single:volume", "plate")):
            done = run(PALPATE, what, self.tracks / track, self.folder / "none.csv")
            self.assertEqual(done.returncode, 77, done.stderr)
        self.assertFalse((self.folder / "none.csv").exists())
        self.assertEqual(run(PALPATE, "neither", self.tracks / "plate", "x.csv").returncode, 2)

    @unittest.skipUnless(GOD_OBJECT, "OPEN_GOD_OBJECT is not set")
    def test_the_plain_god_object_holds_a_plate(self):
        found = self.scored("plate", GOD_OBJECT)
        # It stays 0.1 um in front of each plane.
        self.assertAlmostEqual(found["level_max_um"], 0.1, delta=1e-3)
        self.assertEqual(found["fell_through_frames"], 0)
        done = run(GOD_OBJECT, self.tracks / "sphere", self.folder / "none.csv")
        self.assertEqual(done.returncode, 77)

    @unittest.skipUnless(GOD_OBJECT, "OPEN_GOD_OBJECT is not set")
    def test_what_an_entry_cannot_read_or_write_is_told(self):
        done = run(GOD_OBJECT, self.tracks / "plate", self.folder / "no" / "answer.csv")
        self.assertEqual(done.returncode, 1)
        self.assertIn("answer.csv: cannot be written; name a file in a folder", done.stderr)
        broken = self.folder / "broken"
        shutil.copytree(self.tracks / "plate", broken)
        (broken / "path.csv").write_text("t_s,x_m,y_m,z_m\n0,0,0\n")
        done = run(GOD_OBJECT, broken, self.folder / "answer.csv")
        self.assertIn("path.csv:2: not four numbers; write the tracks anew", done.stderr)
        (broken / "mesh.obj").write_text("# mm\nv 1 2\n")
        done = run(GOD_OBJECT, broken, self.folder / "answer.csv")
        self.assertEqual(done.returncode, 1)
        self.assertIn("mesh.obj:2: neither v nor f", done.stderr)

    @unittest.skipUnless(PALPATE and GOD_OBJECT, "OPEN_PALPATE, OPEN_GOD_OBJECT are not set")
    def test_all_are_entered_into_one_table(self):
        table = self.folder / "table.csv"
        done = run(OPEN / "enter_palpate.py", PALPATE, self.tracks, table, "--runs", "1", "--entry",
                   "adaptive:mesh", "penalty", "--also", f"plain={GOD_OBJECT}")  # fmt: skip
        self.assertEqual(done.returncode, 0, done.stderr)
        with table.open() as file:
            rows = [(row["entry"], row["track"]) for row in csv.DictReader(file)]
        meshes = ["plate", "wedge", "grooves"]
        self.assertEqual(rows, [*(("adaptive:mesh", m) for m in meshes), ("penalty", "sphere"),
                                *(("plain", m) for m in meshes)])  # fmt: skip
        machine = json.loads((self.folder / "table.machine.json").read_text())
        self.assertEqual(machine["cores"], os.cpu_count())
        done = run(OPEN / "enter_palpate.py", PALPATE, self.tracks, table, "--also", "plain")
        self.assertEqual(done.returncode, 2)
        self.assertIn('--also "plain": write NAME=COMMAND', done.stderr)

    @unittest.skipUnless(shutil.which("cmake"), "no cmake")
    def test_another_engine_is_compiled_where_it_is_given(self):
        # The stub has the names of CHAI3D that the adapter uses, and no contact at all.
        build = self.folder / "build"
        subprocess.run(["cmake", "-S", OPEN, "-B", build, f"-DCHAI3D_DIR={STUB}"], check=True,
                       capture_output=True)  # fmt: skip
        subprocess.run(["cmake", "--build", build], check=True, capture_output=True)
        found = self.scored("plate", build / "open_chai3d")
        self.assertGreater(found["fell_through_frames"], 100)
        self.assertGreater(self.scored("plate", build / "open_god_object")["time_ratio_p50"], 1)
        done = run(build / "open_chai3d", self.tracks / "sphere", self.folder / "none.csv")
        self.assertEqual(done.returncode, 77)


if __name__ == "__main__":
    support.main()
