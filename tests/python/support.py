# SPDX-License-Identifier: Apache-2.0
"""What the tests of the Python package share."""

import os
import subprocess
import sys
import unittest
from pathlib import Path

import numpy as np

COMMAND = os.environ.get("PALPATE_COMMAND", "")
ROOT = Path(__file__).resolve().parents[2]


def cavity(**loop):
    """A cavity of 50 mm that rubs, as a dict."""
    return {
        "volume": {"cavity": {"analytic": "sphere_cavity", "radius_mm": 50}},
        "surface": {"wall": {"volume": "cavity"}},
        "effect": [
            {"type": "surface", "surface": "wall"},
            {"type": "friction", "surface": "wall", "static": 0.3, "dynamic": 0.2},
        ],
        "loop": {"rate_hz": 1000.0, **loop},
    }


CAVITY_TOML = """
[volume.cavity]
analytic = "sphere_cavity"
radius_mm = 50
[surface.wall]
volume = "cavity"
[[effect]]
type = "surface"
surface = "wall"
[[effect]]
type = "friction"
surface = "wall"
static = 0.3
dynamic = 0.2
"""


def strokes(count):
    """Positions (count, 3), m, that press up to 4 mm into the cavity's wall, and leave it."""
    t = np.arange(count) / 1000.0
    radius = 0.050 + 0.004 * np.sin(2.0 * np.pi * 0.7 * t)
    angle, height = 2.0 * np.pi * 0.31 * t, 0.6 * np.sin(2.0 * np.pi * 0.13 * t)
    return np.column_stack(
        [
            radius * np.cos(height) * np.cos(angle),
            radius * np.cos(height) * np.sin(angle),
            radius * np.sin(height),
        ]
    )


def write_path(file, positions, rate_hz=1000.0):
    """A probe path as CSV, every bit of it."""
    with open(file, "w", encoding="ascii") as out:
        out.write("t_s,x_m,y_m,z_m\n")
        for i, (x, y, z) in enumerate(positions):
            out.write(f"{i / rate_hz!r},{float(x)!r},{float(y)!r},{float(z)!r}\n")


def run_command(*arguments, cwd):
    """The command's outcome; its cache is in cwd."""
    environment = dict(os.environ, PALPATE_CACHE=str(Path(cwd) / "cache"))
    return subprocess.run(
        [COMMAND, *map(str, arguments)],
        cwd=cwd,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )


def run_python(program, *arguments, cwd=None, timeout=120):
    """The outcome of a program in an interpreter of its own."""
    return subprocess.run(
        [sys.executable, "-c", program, *map(str, arguments)],
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
    )


def main():
    unittest.main(verbosity=2)
