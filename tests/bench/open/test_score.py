# SPDX-License-Identifier: Apache-2.0
"""The scorer's numbers on answers whose errors are known, and its words on wrong ones."""

import csv
import re
import shutil

import numpy as np
import support
from support import OPEN, ROUNDED_UM, WithTracks, run, write_answer

from files import ANSWER_COLUMNS, BadInput
from score import Track, score
from truth import truth_of


class Score(WithTracks):
    TRACKS = ["sphere", "bumps", "sphere_20k", "plate", "wedge", "grooves"]

    def right(self, track):
        """Times, probes, right proxies and forces."""
        times, probes, begins = self.path(track)
        proxies = truth_of(self.tracks / track).proxies(probes, begins)
        return times, probes, proxies, 500 * (proxies - probes)

    def scored(self, track, times, proxies, forces, **ns):
        file = self.folder / "answer.csv"
        write_answer(file, times, proxies, forces, **ns)
        return score(Track(self.tracks / track), file)

    def test_the_right_proxy_has_no_error(self):
        for track in self.TRACKS:
            times, _, proxies, forces = self.right(track)
            found = self.scored(track, times, proxies, forces)
            for column in ("level_max_um", "position_max_um", "deepest_um"):
                # Rounding to 12 decimals, and of a double in the truth itself.
                self.assertLess(found[column], ROUNDED_UM + 1e-7, (track, column))
            for column in ("fell_through_frames", "lost_frames", "ghost_frames", "force_jumps"):
                self.assertEqual(found[column], 0, (track, column))
            self.assertGreater(found["frames_in_contact"], 400)

    def test_a_micrometre_is_a_micrometre(self):
        times, probes, proxies, forces = self.right("sphere")
        inwards = -probes / np.linalg.norm(probes, axis=1)[:, None]
        for sign, deepest in ((1, 0.0), (-1, 1.0)):
            found = self.scored("sphere", times, proxies + sign * 1e-6 * inwards, forces)
            for column in ("level_rms_um", "level_p99_um", "level_max_um", "position_rms_um"):
                self.assertAlmostEqual(found[column], 1.0, delta=ROUNDED_UM + 1e-7)
            self.assertAlmostEqual(found["deepest_um"], deepest, delta=ROUNDED_UM + 1e-7)
        along = self.scored("plate", *self.shifted("plate", [0, 1e-6, 0]))
        self.assertLess(along["level_max_um"], ROUNDED_UM)
        self.assertAlmostEqual(along["position_rms_um"], 1.0, delta=ROUNDED_UM)

    def shifted(self, track, way):
        times, _, proxies, forces = self.right(track)
        return times, proxies + np.array(way), forces

    def test_percentiles_are_numbers_that_occurred(self):
        times, probes, proxies, forces = self.right("plate")
        held = np.flatnonzero(np.linalg.norm(proxies - probes, axis=1) > 1e-9)
        proxies[held[:10], 2] += 1e-3  # 10 of 682: more than 1 %
        found = self.scored("plate", times, proxies, forces)
        self.assertAlmostEqual(found["level_p99_um"], 1000, delta=1e-3)
        self.assertAlmostEqual(found["level_rms_um"], 1000 * np.sqrt(10 / len(held)), delta=1e-3)
        proxies[held[4:10], 2] -= 1e-3  # 4 of 682: less
        self.assertLess(self.scored("plate", times, proxies, forces)["level_p99_um"], 1e-3)

    def test_who_has_no_proxy_has_fallen_through_and_lost_contact(self):
        times, probes, proxies, _ = self.right("plate")
        depth = np.linalg.norm(proxies - probes, axis=1)
        found = self.scored("plate", times, probes, np.zeros_like(probes))
        # Where the plate's side is nearer than 0.1 mm, it counts how far the right proxy is.
        inside = -truth_of(self.tracks / "plate").signed_distance(probes) > 1e-4
        self.assertEqual(found["fell_through_frames"], (inside | (depth > 1e-3)).sum())
        self.assertGreater(found["fell_through_frames"], 0.95 * found["frames_in_contact"])
        self.assertEqual(found["lost_frames"], (500 * depth > 0.1).sum())
        self.assertAlmostEqual(found["deepest_um"], 1e6 * depth.max(), delta=1e3)

    def test_out_of_the_far_side_is_fallen_through(self):
        times, probes, proxies, forces = self.right("plate")
        passed = (proxies - probes)[:, 2] > 2.2e-3  # the far side is 4 mm down, and nearer
        proxies[passed, 2] = -4e-3
        found = self.scored("plate", times, proxies, forces)
        self.assertGreater(passed.sum(), 20)
        self.assertEqual(found["fell_through_frames"], passed.sum())
        self.assertLess(found["level_max_um"], ROUNDED_UM)  # on a surface, the wrong one

    def test_forces_that_leap_and_forces_in_free_space_are_counted(self):
        times, probes, proxies, forces = self.right("plate")
        free = np.flatnonzero(np.linalg.norm(proxies - probes, axis=1) == 0)
        i = free[(times[free] > 0.004) & np.isin(free - 1, free) & np.isin(free + 1, free)][5]
        forces[i, 2] += 0.5
        found = self.scored("plate", times, proxies, forces)
        self.assertEqual((found["force_jumps"], found["ghost_frames"]), (2, 1))
        self.assertAlmostEqual(found["force_jump_max_n"], 0.5, delta=1e-9)

    def test_a_force_is_compared_with_the_spring_to_the_right_proxy(self):
        # Seen: with every force turned round, no column said so.
        times, probes, proxies, forces = self.right("plate")
        right = np.linalg.norm(forces, axis=1)
        held = right > 500 * 1e-9
        turned = self.scored("plate", times, proxies, -forces)
        rounded = np.sqrt(3) * 0.5e-12 + 1e-12
        self.assertAlmostEqual(turned["force_error_max_n"], 2 * right.max(), delta=rounded)
        rms = np.sqrt((right[held] ** 2).mean())
        self.assertAlmostEqual(turned["force_error_rms_n"], 2 * rms, delta=rounded)
        off = self.scored("plate", times, proxies, forces + np.array([0, 0.25, 0]))
        self.assertAlmostEqual(off["force_error_rms_n"], 0.25, delta=rounded)
        self.assertAlmostEqual(off["force_error_max_n"], 0.25, delta=rounded)

    def test_the_stiffness_is_the_one_that_the_track_states(self):
        soft = self.folder / "soft" / "plate"
        shutil.copytree(self.tracks / "plate", soft)
        text = (soft / "shape.txt").read_text().replace("n_per_m 500", "n_per_m 250")
        (soft / "shape.txt").write_text(text)
        times, _, proxies, forces = self.right("plate")
        write_answer(self.folder / "answer.csv", times, proxies, forces / 2)
        found = score(Track(soft), self.folder / "answer.csv")
        self.assertLess(found["force_error_max_n"], 1e-11)
        self.assertEqual((found["lost_frames"], found["force_jumps"]), (0, 0))

    def test_times_are_ratios_to_the_kernel(self):
        times, _, proxies, forces = self.right("plate")
        found = self.scored("plate", times, proxies, forces, ns=3000, reference_ns=1500)
        self.assertAlmostEqual(found["time_ratio_p50"], 2.0, delta=50 / 1500)  # 0 to 49 ns are added
        self.assertEqual(found["reference_ns_p99"], 1500)

    def test_the_table_has_every_column_and_the_command_ends_with_0(self):
        answers = self.folder / "answers"
        answers.mkdir()
        times, _, proxies, forces = self.right("wedge")
        write_answer(answers / "wedge.csv", times, proxies, forces)
        done = run(OPEN / "score.py", self.tracks, answers, "--entry", "mine", "--out",
                   self.folder / "table.csv")  # fmt: skip
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("plate: left out", done.stderr)
        with (self.folder / "table.csv").open() as file:
            (row,) = csv.DictReader(file)
        self.assertEqual((row["entry"], row["track"], row["frozen"]), ("mine", "wedge", "1"))
        self.assertNotIn("", row.values())
        self.assertRegex(done.stdout, "ghost_frames +force_error_rms_n")
        self.assertNotRegex(done.stdout, r"[0-9]e-1\d")  # what an answer cannot say is not printed

    def test_a_track_that_was_changed_is_told(self):
        changed, answers = self.folder / "changed", self.folder / "to_changed"
        shutil.copytree(self.tracks / "wedge", changed / "wedge")
        answers.mkdir()
        shape = changed / "wedge" / "shape.txt"
        shape.write_text(shape.read_text().replace("half_length_mm 50", "half_length_mm 60"))
        times, _, proxies, forces = self.right("wedge")
        write_answer(answers / "wedge.csv", times, proxies, forces)
        done = run(OPEN / "score.py", changed, answers)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("wedge: is not the frozen track", done.stderr)


class BadAnswers(WithTracks):
    def refused(self, change):
        """The message on an answer whose lines were changed."""
        times, probes, _ = self.path("plate")
        file = self.folder / "plate.csv"
        write_answer(file, times, probes, probes)
        lines = file.read_text().splitlines()
        file.write_text("\n".join(change(lines)) + "\n")
        with self.assertRaises(BadInput) as caught:
            score(Track(self.tracks / "plate"), file)
        done = run(OPEN / "score.py", self.tracks, self.folder)
        self.assertEqual(done.returncode, 2)
        self.assertEqual(done.stderr.splitlines()[-1], f"score.py: {caught.exception}")
        return str(caught.exception).removeprefix(str(file))

    def test_messages_name_line_value_and_remedy(self):
        def cell(line, column, text):
            def change(lines):
                cells = lines[line - 1].split(",")
                cells[column] = text
                return [*lines[: line - 1], ",".join(cells), *lines[line:]]

            return change

        word, nan = self.refused(cell(7, 2, "high")), self.refused(cell(9, 4, "nan"))
        remedy = "is no finite number; write one, such as 0.001"
        self.assertEqual(word, f':7: proxy_y_m = "high" {remedy}')
        self.assertTrue(nan.startswith(':9: force_x_n = "nan" is no finite number'))
        self.assertIn(":5: t_s = 0.9, but the path has 0.003", self.refused(cell(5, 0, "0.9")))
        self.assertIn(":6: ns = -1 is below 0; write", self.refused(cell(6, 7, "-1")))
        self.assertIn(":6: reference_ns = 0 is below 1; write", self.refused(cell(6, 8, "0")))
        self.assertIn(':1: the header is "t,x"; write exactly "' + ANSWER_COLUMNS,
                      self.refused(lambda lines: ["t,x", *lines[1:]]))  # fmt: skip
        self.assertIn(": 1149 rows, but the path has 1150; write one row for each row",
                      self.refused(lambda lines: lines[:-1]))  # fmt: skip
        self.assertIn(":3: 2 values; write 9: t_s",
                      self.refused(lambda lines: [*lines[:2], "1,2", *lines[3:]]))  # fmt: skip

    def test_what_is_not_there_is_told(self):
        empty = self.folder / "empty"
        empty.mkdir()
        for words, said in (
            ((self.tracks, empty), "has no answer to a track of"),
            ((self.folder / "nowhere", empty), "nowhere: is no folder; give TRACKS"),
            ((self.tracks, self.folder / "nowhere"), "nowhere: is no folder; give TRACKS"),
            ((self.tracks,), "required: ANSWERS"),
            ((self.tracks, empty, "--seed", "3"), "--seed is of --rerun"),
            ((self.tracks, empty, "--out", "/proc/x.csv"), "/proc/x.csv: cannot be written ("),
            ((self.tracks, empty, "--out", empty), "empty: cannot be written (it is a folder)"),
        ):
            done = run(OPEN / "score.py", *words)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(said, done.stderr)
            self.assertNotIn("Traceback", done.stderr)


class BadTracks(WithTracks):
    """What a track cannot be is refused by the scorer, in one line, with exit status 2."""

    TRACKS = ["plate", "bumps"]

    def refused(self, track, name, change, said):
        """`change` is of the file's text; None removes it."""
        tracks, answers = self.folder / "changed", self.folder / "answers"
        shutil.rmtree(tracks, ignore_errors=True)
        shutil.copytree(self.tracks / track, tracks / track)
        answers.mkdir(exist_ok=True)
        times, probes, _ = self.path(track)
        write_answer(answers / f"{track}.csv", times, probes, probes)
        file = tracks / track / name
        if change is None:
            file.unlink()
        else:
            file.write_text(change(file.read_text()))
        done = run(OPEN / "score.py", tracks, answers)
        self.assertEqual(done.returncode, 2, done.stdout + done.stderr)
        self.assertIn(f"score.py: {file}{said}", done.stderr.splitlines()[-1])

    def test_shapes(self):
        def radius(text):
            return lambda before: re.sub("radius_mm .*\n", text, before)

        for change, said in (
            (None, ": cannot be read (No such file or directory)"),
            (radius("radius_mm words\n"), ':2: radius_mm = "words" is no finite number'),
            (radius("radius_mm nan\n"), ':2: radius_mm = "nan" is no finite number'),
            (radius("radius_mm -5\n"), ":2: radius_mm = -5 is not above 0"),
            (radius(""), ": has no radius_mm; write the track anew with tracks.py"),
            (radius("radius_mm 50\nradius_mm 5\n"), ':3: "radius_mm" is there twice'),
            (lambda text: text.replace("bumpy_cavity", "egg"), ':1: shape "egg" is none of mesh, '),
            (lambda text: text.replace("m 500", "m 0"), ":5: stiffness_n_per_m = 0 is not above 0"),
        ):
            self.refused("bumps", "shape.txt", change, said)
        for change, said in (
            (lambda text: re.sub("profile_mm .*", "profile_mm 1 2 3", text), ':2: profile_mm "1 2 3"'),
            (lambda text: re.sub("bottom_mm .*", "bottom_mm 4", text), ":3: bottom_mm = 4 is not below"),
        ):
            self.refused("plate", "shape.txt", change, said)

    def test_meshes(self):
        def last(line):
            return lambda text: text + line + "\n"

        end = (self.tracks / "plate" / "mesh.obj").read_text().count("\n") + 1
        for change, said in (
            (lambda _: "", ": has no vertices or no triangles; write the track anew"),
            (last("v nan 0 0"), f':{end}: "v nan 0 0" is not 3 finite numbers'),
            (last("v high 0 0"), f':{end}: "v high 0 0" is not 3 finite numbers'),
            (last("f 1 2 999999999"), f':{end}: "f 1 2 999999999" has a corner that is none of the'),
            (last("f 1 2 -1"), f':{end}: "f 1 2 -1" has a corner that is none of the vertices'),
            (last("f 1 2 3 4"), f':{end}: "f 1 2 3 4" is neither v nor f with 3 numbers'),
            (last("f 1 1 2"), f':{end}: "f 1 1 2" is a triangle without an area'),
        ):
            self.refused("plate", "mesh.obj", change, said)

    def test_paths(self):
        for change, said in (
            (lambda text: text.splitlines()[0] + "\n", ":1: no row follows the header"),
            (lambda text: text.partition("\n")[2], ':1: the header is "0.000,'),
            (lambda text: text.replace("\n0.003,", "\n0.003,nan,", 1), ":5: 5 values; write 4"),
            (lambda text: re.sub("\n0.003,[^,]*", "\n0.003,nan", text, 1), ':5: x_m = "nan" is no'),
            (lambda text: text.replace("\n0.003,", "\n0.001,", 1), ":5: t_s = 0.001 is neither 0 nor"),
            (lambda text: text.splitlines()[0] + "\n0,0,0,1\n", ": the probe never touches the surface"),
            (lambda text: text.splitlines()[0] + "\n0,0,0,-0.001\n", ":2: a trial begins inside of the"),
        ):
            self.refused("plate", "path.csv", change, said)


if __name__ == "__main__":
    support.main()
