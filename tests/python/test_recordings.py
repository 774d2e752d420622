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

    def test_each_of_several_hands_is_traced_as_if_it_were_alone(self):
        orbit = {"type": "orbit", "duration_s": 0.5}
        hands = [
            {"name": "left", "speed_m_per_s": 0.1, **orbit},
            {"name": "right", "speed_m_per_s": 0.3, **orbit},
        ]
        self.assertEqual(palpate.Scene({**cavity(), "device": orbit}).hands, [])
        scene = palpate.Scene({**cavity(), "device": hands})
        self.assertEqual(scene.hands, ["left", "right"])
        with self.assertRaisesRegex(palpate.SceneError, "has the hands left, right"):
            palpate.trace(scene)
        with self.assertRaisesRegex(palpate.ArgumentError, "take one of left, right"):
            scene.of_hand("third")
        for hand, speed in (("left", 0.1), ("right", 0.3)):
            alone = palpate.Scene({**cavity(), "device": {**orbit, "speed_m_per_s": speed}})
            trace = palpate.trace(scene.of_hand(hand))
            self.assert_same(trace, palpate.trace(alone))
            with tempfile.TemporaryDirectory() as folder:
                file = Path(folder) / "recording.h5"
                trace.save(file)
                self.assertEqual(palpate.read_recording(file).hand, hand)
                self.assert_same(palpate.replay(file), trace)

    def test_a_recording_of_several_hands_is_read_by_their_names(self):
        hand = '[[device]]\nname = "{}"\ntype = "orbit"\nduration_s = {}\n'
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "cavity.toml"
            file.write_text(CAVITY_TOML + hand.format("left", 0.5) + hand.format("right", 1))
            said = run_command("trace", file, "--out", "out", cwd=folder)
            self.assertEqual(said.returncode, 0, said.stderr)
            written = Path(folder) / "out" / "recording.h5"
            self.assertEqual(palpate.recorded_hands(written), ["left", "right"])
            with self.assertRaisesRegex(palpate.FileError, "say which one"):
                palpate.read_recording(written)
            for name in ("left", "right"):
                recording = palpate.read_recording(written, name)
                self.assertEqual(recording.hand, name)
                self.assert_same(palpate.replay(recording), recording)
                self.assert_same(palpate.trace(palpate.Scene(file).of_hand(name)), recording)


if __name__ == "__main__":
    main()
