# SPDX-License-Identifier: Apache-2.0
"""What the tests of the open benchmark share."""

import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[3]
OPEN = ROOT / "bench" / "open"
CHEATS = pathlib.Path(__file__).resolve().parent / "cheats"
sys.path.insert(0, str(OPEN))

from files import ANSWER_COLUMNS, read_path  # noqa: E402
from tracks import FROZEN_SEED, write_tracks  # noqa: E402

PALPATE = os.environ.get("OPEN_PALPATE", "")
GOD_OBJECT = os.environ.get("OPEN_GOD_OBJECT", "")
SKULL = pathlib.Path(os.environ.get("OPEN_SKULL", "none"))
# Coordinates in an answer have 12 decimals: half of the last one on each axis, um.
ROUNDED_UM = 1e6 * np.sqrt(3) * 0.5e-12


def run(*words, cwd=None):
    """The outcome of a command; a script of the benchmark is run by this interpreter."""
    words = [str(w) for w in words]
    if words[0].endswith(".py"):
        words.insert(0, sys.executable)
    return subprocess.run(words, cwd=cwd, capture_output=True, text=True, check=False, timeout=800)


def write_answer(file, times, proxies, forces, ns=2000.0, reference_ns=1000.0):
    rows = [ANSWER_COLUMNS]
    for n, (t, proxy, force) in enumerate(zip(times, proxies, forces)):
        position, force = (",".join(f"{v:.12f}" for v in vector) for vector in (proxy, force))
        rows.append(f"{t:.3f},{position},{force},{ns + n % 50:.0f},{reference_ns:.0f}")
    file.write_text("\n".join(rows) + "\n")


class WithTracks(unittest.TestCase):
    """Has the frozen tracks that a test names in TRACKS."""

    TRACKS = ["plate"]

    @classmethod
    def setUpClass(cls):
        cls._folder = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls._folder.name)
        cls.tracks = cls.folder / "tracks"
        cls.tracks.mkdir()
        write_tracks(cls.tracks, FROZEN_SEED, cls.TRACKS)

    @classmethod
    def tearDownClass(cls):
        cls._folder.cleanup()

    def path(self, track):
        """Times, probes, and where trials begin."""
        times, probes = read_path(self.tracks / track)
        return times, probes, times == 0


def main():
    unittest.main(verbosity=2)
