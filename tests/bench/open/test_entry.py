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
        self.assertEqual(done.returncode, 2)
        self.assertIn("answer.csv: cannot be written (No such file or directory); name a file in a",
                      done.stderr)  # fmt: skip
        done = run(GOD_OBJECT, self.folder / "nosuch", self.folder / "answer.csv")
        self.assertEqual(done.returncode, 2)
        self.assertIn("nosuch/shape.txt: cannot be read (No such file or directory); give the folder",
                      done.stderr)  # fmt: skip

    @unittest.skipUnless(GOD_OBJECT, "OPEN_GOD_OBJECT is not set")
    def test_a_track_that_cannot_be_true_is_refused_with_its_line(self):
        def last(line):
            return lambda text: text + line + "\n"

        end = (self.tracks / "plate" / "mesh.obj").read_text().count("\n") + 1
        for name, change, said in (
            ("mesh.obj", last("f 1 2 999999999"), f':{end}: "f 1 2 999999999" has a corner that is'),
            ("mesh.obj", last("f 1 2 -1"), f':{end}: "f 1 2 -1" has a corner that is none of the'),
            ("mesh.obj", last("f 1 2 1.5"), f':{end}: "f 1 2 1.5" has a corner that is none of the'),
            ("mesh.obj", last("f 1 2 3 4"), f':{end}: "f 1 2 3 4" is neither v nor f with 3 finite'),
            ("mesh.obj", last("f 1 1 2"), f':{end}: "f 1 1 2" is a triangle without an area'),
            ("mesh.obj", last("v nan 0 0"), f':{end}: "v nan 0 0" is neither v nor f with 3 finite'),
            ("mesh.obj", last("v 1 2"), f':{end}: "v 1 2" is neither v nor f with 3 finite numbers'),
            ("mesh.obj", lambda _: "", ": has no triangles; write the track anew"),
            ("path.csv", lambda t: t.replace("\n0.003,", "\n0.003,nan,", 1), ':5: "0.003,nan,'),
            ("path.csv", lambda t: t.replace("\n0.003,", "\nnan,", 1), ':5: "nan,'),
            ("path.csv", lambda t: t.replace("\n0.003,", "\n0.001,", 1), ':5: "0.001,'),
            ("path.csv", lambda t: t.partition("\n")[2], ':1: "0.000,'),
            ("path.csv", lambda t: t.partition("\n")[0] + "\n", ": has no rows; write the track"),
            ("path.csv", lambda _: "", ": has no header; write the track"),
            ("shape.txt", lambda t: t.replace("profile", "egg", 1), ": has no shape mesh, profile,"),
            ("shape.txt", lambda t: t.replace("m 500", "m 300"), ':5: "stiffness_n_per_m 300" is not'),
            ("shape.txt", lambda t: t + "radius_mm nan\n", ':6: "radius_mm nan" is not one number'),
            ("shape.txt", lambda t: t.replace("stiff", "still"), ": has no stiffness_n_per_m; write"),
        ):
            broken = self.folder / "broken"
            shutil.rmtree(broken, ignore_errors=True)
            shutil.copytree(self.tracks / "plate", broken)
            (broken / name).write_text(change((broken / name).read_text()))
            done = run(GOD_OBJECT, broken, self.folder / "never.csv")
            self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1), (said, done.stderr))
            self.assertIn(f"entry: {broken / name}{said}", done.stderr)
        self.assertFalse((self.folder / "never.csv").exists())

    @unittest.skipUnless(shutil.which("cc"), "no C compiler")
    def test_an_engine_that_gives_no_number_has_failed(self):
        code = self.folder / "nan.c"
        code.write_text(f'''#include "{OPEN / "entry.h"}"
            static void begin(void* e, const double* p) {{ (void)e, (void)p; }}
            static void frame(void* e, const double* p, double* proxy, double* force) {{
                (void)e;
                for (int i = 0; i < 3; ++i) proxy[i] = p[i], force[i] = 0.0 / (p[i] - p[i]);
            }}
            int main(int argc, char** argv) {{
                struct entry_track track;
                return argc == 3 && !entry_load(argv[1], &track)
                           ? entry_run(&track, argv[2], 0, begin, frame) : 3;
            }}''')
        engine = self.folder / "nan"
        subprocess.run(["cc", code, OPEN / "entry.c", OPEN / "reference_kernel.c", "-O2", "-o", engine,
                        "-lm"], check=True)  # fmt: skip
        done = run(engine, self.tracks / "plate", self.folder / "never.csv")
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("row 2 of the path: the engine gave a proxy or a force that is no finite number",
                      done.stderr)  # fmt: skip
        self.assertFalse((self.folder / "never.csv").exists())

    @unittest.skipUnless(PALPATE and GOD_OBJECT, "OPEN_PALPATE, OPEN_GOD_OBJECT are not set")
    def test_all_are_entered_into_one_table(self):
        # A relative folder of tracks: seen to be looked for in the track itself.
        table = self.folder / "table.csv"
        done = run(OPEN / "enter_palpate.py", PALPATE, "tracks", "table.csv", "--runs", "1", "--entry",
                   "adaptive:mesh", "penalty", "--also", f"plain={GOD_OBJECT}", cwd=self.folder)  # fmt: skip
        self.assertEqual(done.returncode, 0, done.stderr)
        with table.open() as file:
            rows = [(row["entry"], row["track"]) for row in csv.DictReader(file)]
        meshes = ["plate", "wedge", "grooves"]
        self.assertEqual(rows, [*(("adaptive:mesh", m) for m in meshes), ("penalty", "sphere"),
                                *(("plain", m) for m in meshes)])  # fmt: skip
        machine = json.loads((self.folder / "table.machine.json").read_text())
        self.assertEqual(machine["cores"], os.cpu_count())

    @unittest.skipUnless(PALPATE, "OPEN_PALPATE is not set")
    def test_what_cannot_be_entered_is_told_before_anything_is_measured(self):
        table = self.folder / "none.csv"
        for words, said in (
            ([self.tracks, table, "--also", "plain"], '--also "plain": write NAME=COMMAND'),
            ([self.tracks, table, "--also", "a=./none"], '"./none" cannot be run; name a program'),
            ([self.tracks, table, "--runs", "0"], '"0" is no number from 1 to 99'),
            ([self.tracks, self.folder / "no" / "x.csv"], "x.csv: cannot be written (No such file"),
            ([self.folder / "nowhere", table], "nowhere: has no track; write them with tracks.py"),
        ):
            done = run(OPEN / "enter_palpate.py", PALPATE, *words)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(said, done.stderr)
            self.assertNotIn("Traceback", done.stderr)
        self.assertFalse(table.exists())

    @unittest.skipUnless(PALPATE, "OPEN_PALPATE is not set")
    def test_an_entrant_that_fails_does_not_take_the_others_along(self):
        table = self.folder / "others.csv"
        done = run(OPEN / "enter_palpate.py", PALPATE, self.tracks, table, "--runs", "1", "--entry",
                   "penalty", "--also", "fails=false")  # fmt: skip
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("fails on plate ended with 1 and wrote no answer: it said nothing", done.stderr)
        with table.open() as file:
            self.assertEqual([row["entry"] for row in csv.DictReader(file)], ["penalty"])

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
