#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a trace of 100,000 frames costs in Python, against the same in C++ (bench/trace_time.cpp).

    PYTHONPATH=build/release/python bench/python_trace.py build/release/bench_trace_time [RUNS]

Both run in turn, so that what else the machine does meets both; medians are compared. Python's time
is from an array of positions to the arrays of all columns.
"""

import json
import statistics
import subprocess
import sys
import time

import numpy as np

import palpate

SCENE = {
    "volume": {"cavity": {"analytic": "sphere_cavity", "radius_mm": 50}},
    "surface": {"wall": {"volume": "cavity"}},
    "effect": [{"type": "surface", "surface": "wall"}],
    "device": {"type": "orbit", "duration_s": 100},
}
FRAMES = 100000


def cpp_ms(program):
    """One run in C++, ms."""
    options = ["--benchmark_format=json", "--benchmark_min_time=0.001"]
    said = subprocess.run([program, *options], capture_output=True, check=True).stdout
    return json.loads(said)["benchmarks"][0]["real_time"]


def python_ms(scene, positions):
    """One run in Python, ms."""
    begin = time.perf_counter()
    trace = palpate.trace(scene, positions)
    for name in trace.columns:
        trace[name]
    return 1e3 * (time.perf_counter() - begin)


def main():
    program, runs = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 15
    scene = palpate.Scene(SCENE)
    positions = scene.path()[:, 1:]
    last = np.repeat(positions[-1:], max(0, FRAMES - len(positions)), axis=0)
    positions = np.vstack([positions, last])[:FRAMES]
    times = [(cpp_ms(program), python_ms(scene, positions)) for _ in range(runs + 1)][1:]
    cpp, python = (statistics.median(column) for column in zip(*times))
    ratio = statistics.median(b / a for a, b in times)
    print(
        f"{FRAMES} frames, medians of {runs}: C++ {cpp:.1f} ms, Python {python:.1f} ms, "
        f"{python / cpp:.3f} times; median of the runs' ratios {ratio:.3f}"
    )


if __name__ == "__main__":
    main()
