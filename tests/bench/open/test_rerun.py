# SPDX-License-Identifier: Apache-2.0
"""A rerun on tracks that nobody has seen finds who cheats, and nobody else."""

import contextlib
import io
import re
import sys
import unittest
from unittest import mock

import numpy as np
import support
from support import CHEATS, GOD_OBJECT, OPEN, PALPATE, WithTracks, run

import rerun
from files import read_path
from tracks import write_track

CHEAT = f"{sys.executable} {CHEATS / 'cheat.py'}"
# What a machine that is busy with something else may do to an honest entrant, and nothing else.
OF_TIMES = "reference_ns is|of the reference kernel"


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

    def check_only_times_are_suspected(self, done):
        """Which times are suspected is tested with given times (RulesOfTimes), not with this machine's."""
        found = [line for line in done.stderr.splitlines() if line and "left out" not in line]
        self.assertEqual([line for line in found if not re.search(OF_TIMES, line)], [])
        self.assertEqual(done.returncode, 1 if found else 0, done.stderr)
        end = "[0-9]+ suspicions?" if found else "nothing suspicious"
        number = r"\d+(\.\d+)?"
        self.assertRegex(done.stdout, "rerun with seed 2027\n"
                         f"plate, one round: a frame takes {number} of its own kernel, {number} of the "
                         f"one measured here\nplate, 4 rounds: .*\n(plate.*\n)*rerun: {end}")  # fmt: skip

    @unittest.skipUnless(GOD_OBJECT, "OPEN_GOD_OBJECT is not set")
    def test_an_honest_entrant_is_not_suspected(self):
        answers = self.answers_of("honest", GOD_OBJECT)
        self.check_only_times_are_suspected(self.rerun(answers, GOD_OBJECT))

    @unittest.skipUnless(PALPATE, "OPEN_PALPATE is not set")
    def test_a_fast_honest_entrant_is_not_suspected(self):
        answers = self.answers_of("fast", PALPATE, "adaptive:mesh")
        done = self.rerun(answers, f"{PALPATE} adaptive:mesh")
        self.check_only_times_are_suspected(done)

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


class GivenKernel:
    """Says of each run of an entrant, in turn, whether its kernel is off."""

    def __init__(self, off):
        self.off = iter(off)

    def differs(self, run, fresh):
        return ["its reference_ns is off"] if next(self.off) else []


class RulesOfTimes(unittest.TestCase):
    FELT = {"frames_in_contact": 1000, "fell_through_frames": 0, "lost_frames": 0,
            "time_ratio_p50": 1.0}  # fmt: skip

    def suspicions(self, *off):
        """Of an entrant whose answers are right, when its kernel is off in these runs."""
        rows = iter((100, 400) * rerun.LOOKS)
        with contextlib.ExitStack() as stack:
            stack.enter_context(contextlib.redirect_stdout(io.StringIO()))
            for name, value in {"_Kernel": lambda folder: GivenKernel(off),
                                "_run": lambda words, track, answer: (1e3, 1e9),
                                "read_rows": lambda file, columns: np.zeros((next(rows), 9)),
                                }.items():  # fmt: skip
                stack.enter_context(mock.patch.object(rerun, name, value))
            return rerun.suspicions("true", 2027, {"plate": self.FELT}, lambda *_: self.FELT)

    def test_a_run_of_two_that_is_off_is_a_busy_machine(self):
        self.assertEqual(self.suspicions(True, False), [])
        self.assertEqual(self.suspicions(False, True), [])

    def test_a_look_of_three_that_is_as_it_should_be_is_enough(self):
        self.assertEqual(self.suspicions(True, True, True, True, False, True), [])

    def test_a_kernel_that_is_off_in_each_run_of_each_look_is_suspected(self):
        self.assertEqual(self.suspicions(*6 * [True]), ["plate: its reference_ns is off"])

    def test_a_fresh_track_may_take_twice_the_time_of_the_known_one(self):
        for known, fresh, many in ((1, 1, 0), (1, 1.99, 0), (1, 2.01, 1), (0.019, 1, 2),
                                   (0.021, 0.041, 0), (1, 0.019, 1)):  # fmt: skip
            found = [*rerun._times({"time_ratio_p50": known}, {"time_ratio_p50": fresh})]
            self.assertEqual(len(found), many, (known, fresh, found))
            for line in found:
                self.assertRegex(line, OF_TIMES)


class OwnKernel(unittest.TestCase):
    def found(self, said_ns, *measured_ns):
        kernel = object.__new__(rerun._Kernel)
        kernel.before_ns, kernel._ns = measured_ns[0], lambda: measured_ns[1]
        with contextlib.redirect_stdout(io.StringIO()):
            return [*kernel.differs("plate", {"time_ratio_p50": 1.0, "ns_p50": said_ns,
                                              "reference_ns_p50": said_ns})]  # fmt: skip

    def test_a_kernel_may_differ_by_half_from_those_before_and_after(self):
        for said, many in ((1490, 0), (1510, 1), (680, 0), (660, 1)):
            self.assertEqual(len(self.found(said, 1000, 1000)), many, said)
        self.assertEqual(self.found(2900, 1000, 2000), [])  # the machine has slowed down meanwhile
        self.assertRegex(self.found(3100, 1000, 2000)[0], OF_TIMES)


if __name__ == "__main__":
    support.main()
