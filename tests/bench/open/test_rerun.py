# SPDX-License-Identifier: Apache-2.0
"""A rerun on tracks that nobody has seen finds who cheats, and nobody else."""

import sys
import unittest

import numpy as np
import support
from support import CHEATS, GOD_OBJECT, OPEN, PALPATE, WithTracks, run

from files import read_path
from tracks import write_track

CHEAT = f"{sys.executable} {CHEATS / 'cheat.py'}"


class Rerun(WithTracks):
    TRACKS = ["plate", "sphere"]

    def answers_of(self, name, *words, tracks=("plate",)):
        """The folder of what a command answers to the known tracks."""
        answers = self.folder / name
        answers.mkdir()
        for track in tracks:
            done = run(*words, self.tracks / track, answers / f"{track}.csv")
            self.assertEqual(done.returncode, 0, done.stderr)
        return answers

    def rerun(self, answers, command, seed="2027"):
        return run(OPEN / "score.py", self.tracks, answers, "--rerun", command, "--seed", seed)

    @unittest.skipUnless(GOD_OBJECT, "OPEN_GOD_OBJECT is not set")
    def test_an_honest_entrant_is_not_suspected(self):
        answers = self.answers_of("honest", GOD_OBJECT)
        done = self.rerun(answers, GOD_OBJECT)
        self.assertEqual(done.returncode, 0, done.stderr)
        number = r"\d+(\.\d+)?"
        self.assertRegex(done.stdout, "rerun with seed 2027\n"
                         f"plate, one round: a frame takes {number} of its own kernel, {number} of the "
                         "one measured here\nplate, 4 rounds: .*\n(plate.*\n)*rerun: nothing suspicious")  # fmt: skip

    @unittest.skipUnless(PALPATE, "OPEN_PALPATE is not set")
    def test_a_fast_honest_entrant_is_not_suspected(self):
        answers = self.answers_of("fast", PALPATE, "adaptive:mesh")
        done = self.rerun(answers, f"{PALPATE} adaptive:mesh")
        self.assertEqual(done.returncode, 0, done.stderr)

    @unittest.skipUnless(GOD_OBJECT, "OPEN_GOD_OBJECT is not set")
    def test_recorded_positions_are_wrong_on_fresh_tracks(self):
        known = self.answers_of("known", GOD_OBJECT)
        done = self.rerun(known, f"{CHEAT} recorded:{known}")
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"plate: position_rms_um is \S+ on a fresh track")

    def cheat(self, kind, tracks=("plate",)):
        answers = self.answers_of(kind, *CHEAT.split(), kind, tracks=tracks)
        done = self.rerun(answers, f"{CHEAT} {kind}")
        self.assertEqual(done.returncode, 1, done.stdout)
        self.assertRegex(done.stdout, "rerun: (1 suspicion|[0-9]+ suspicions)\n")
        return done.stderr

    def test_right_positions_in_no_time_are_found(self):
        said = self.cheat("no_time", ("plate", "sphere"))
        for track in ("plate", "sphere"):
            self.assertRegex(said, f"{track}: on the known track a frame takes .* of the reference")
            self.assertRegex(said, f"{track}: on a fresh track a frame takes .* of the reference")

    def test_a_kernel_that_is_too_slow_is_found(self):
        self.assertRegex(self.cheat("slow_kernel"), "reference_ns is .* times what the kernel takes")

    def test_work_outside_of_the_clock_is_found(self):
        self.assertIn("work outside of the clock", self.cheat("unclocked"))

    def test_work_outside_of_the_clock_is_found_where_rows_are_remembered(self):
        # Seen: the longer path had the same trials again and again, and this entrant passed.
        self.assertIn("work outside of the clock", self.cheat("remembered"))
        for rounds in (range(1), range(1, 5)):
            write_track(self.folder / "rounds", "plate", 2027, rounds=rounds)
            _, probes = read_path(self.folder / "rounds" / "plate")
            if rounds.start:
                self.assertEqual(len(np.unique(np.concatenate([once, probes]), axis=0)),
                                 len(once) + len(probes))  # fmt: skip
            once = probes

    def test_a_force_that_gets_worse_is_found(self):
        answers = self.answers_of("forwards", *CHEAT.split(), "other")
        done = self.rerun(answers, f"{CHEAT} backwards")
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"plate: force_error_rms_n is \S+ on a fresh track, \S+ on the known")

    def test_a_command_that_fails_is_told_with_its_last_line(self):
        answers = self.answers_of("of_a_cheat", *CHEAT.split(), "no_time")
        done = self.rerun(answers, f"{CHEAT} recorded:/nowhere")
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, "plate: the command ended with 1 and wrote no answer: .*nowhere")

    def test_what_cannot_be_rerun_is_wrong_input(self):
        answers = self.answers_of("any", *CHEAT.split(), "no_time")
        done = self.rerun(answers, "./not_there --fast")
        self.assertEqual(done.returncode, 2)
        self.assertIn('"./not_there" cannot be run', done.stderr)
        done = self.rerun(answers, 'open "quotation')
        self.assertEqual(done.returncode, 2)
        self.assertIn('--rerun "open "quotation": No closing quotation; close it', done.stderr)
        done = self.rerun(answers, CHEAT, seed="1")
        self.assertEqual(done.returncode, 2)
        self.assertIn("is the seed that everybody knows", done.stderr)


if __name__ == "__main__":
    support.main()
