# SPDX-License-Identifier: Apache-2.0
"""The examples in Python run."""

import importlib.util
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from support import ROOT, main

EXAMPLES = ROOT / "examples"


class Examples(unittest.TestCase):
    def test_the_error_time_picture_is_drawn(self):
        if importlib.util.find_spec("matplotlib") is None:
            self.skipTest("python3-matplotlib is not installed")
        with tempfile.TemporaryDirectory() as folder:
            picture = Path(folder) / "picture.png"
            program = EXAMPLES / "python" / "error_time.py"
            outcome = subprocess.run(
                [sys.executable, program, EXAMPLES / "cavity.toml", picture, "300"],
                capture_output=True,
                text=True,
                check=False,
            )
            self.assertEqual(outcome.returncode, 0, outcome.stderr)
            self.assertIn("of 300 frames", outcome.stdout)
            self.assertTrue(picture.read_bytes().startswith(b"\x89PNG"))
            self.assertGreater(picture.stat().st_size, 10000)


if __name__ == "__main__":
    main()
