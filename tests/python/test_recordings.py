# SPDX-License-Identifier: Apache-2.0
"""Recordings are read, written and computed again, bit for bit."""

import os
import tempfile
import unittest
from pathlib import Path

import numpy as np
from support import CAVITY_TOML, cavity, main, run_command, strokes

import palpate
from palpate.runs import Frames

_BY_THE_CLOCK = ("spent_us", "estimate_us", "late_us")


class Recordings(unittest.TestCase):
    def assert_same(self, one, other, but=_BY_THE_CLOCK):
        for name in Frames.columns:
            if name not in but:
                np.testing.assert_array_equal(one[name], other[name], name)

    def test_a_saved_trace_is_read_and_replayed_by_us_and_by_the_command(self):
        scene = palpate.Scene(cavity())
        for changes in ({}, {"method": "fixed", "sub_steps": 3}, {"method": "paper"}):
            count = 300 if changes.get("method") == "paper" else 1500  # that takes all its time
            trace = palpate.trace(scene, strokes(count), **changes)
            with tempfile.TemporaryDirectory() as folder:
                file = Path(folder) / "recording.h5"
                trace.save(file)
                recording = palpate.read_recording(file)
                self.assert_same(recording, trace, but=())
                self.assertEqual(recording.attributes["version"], palpate.__version__)
                self.assertEqual(recording.scene_text, scene.text)
                self.assert_same(palpate.replay(recording), trace)
                self.assert_same(palpate.replay(file), trace)
                said = run_command("replay", file, "--check", cwd=folder)
                self.assertEqual(said.stdout, f"0 of {count} frames differ\n")
                self.assertEqual(said.returncode, 0)

    def test_a_recording_of_the_command_is_ours(self):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "cavity.toml"
            file.write_text(CAVITY_TOML + '[device]\ntype = "orbit"\nduration_s = 1\n')
            said = run_command("trace", file, "--out", "out", cwd=folder)
            self.assertEqual(said.returncode, 0, said.stderr)
            recording = palpate.read_recording(Path(folder) / "out" / "recording.h5")
            self.assertGreater((recording["felt"] == "wall").sum(), 100)
            self.assert_same(palpate.replay(recording), recording)
            self.assertEqual(recording.scene_file, os.fspath(file))
            self.assert_same(palpate.trace(palpate.Scene(file)), recording)


if __name__ == "__main__":
    main()
