#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a trace of 100,000 frames costs in Python, against the same in C++ (bench/trace_time.cpp).

    PYTHONPATH=build/release/python bench/python_trace.py build/release/bench_trace_time [RUNS]

Both run in turn, so that what else the machine does meets both; medians are compared, of the time
that passed and of the processor's. Python's is from an array of positions to the arrays of all
columns.
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
    """One run in C++: time and processor's time, ms."""
    options = ["--benchmark_format=json", "--benchmark_min_time=0.001"]
    said = subprocess.run([program, *options], capture_output=True, check=True).stdout
    run = json.loads(said)["benchmarks"][0]
    return run["real_time"], run["cpu_time"]


def python_ms(scene, positions):
    """The same in Python."""
    begin, worked = time.perf_counter(), time.process_time()
    trace = palpate.trace(scene, positions)
    for name in trace.columns:
        trace[name]
    return 1e3 * (time.perf_counter() - begin), 1e3 * (time.process_time() - worked)


def main():
    program, runs = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 15
    scene = palpate.Scene(SCENE)
    positions = scene.path()[:, 1:]
    last = np.repeat(positions[-1:], max(0, FRAMES - len(positions)), axis=0)
    positions = np.vstack([positions, last])[:FRAMES]
    times = [(cpp_ms(program), python_ms(scene, positions)) for _ in range(runs + 1)][1:]
    print(f"{FRAMES} frames, medians of {runs}")
    for i, clock in enumerate(("time", "processor's time")):
        cpp = statistics.median(run[0][i] for run in times)
        python = statistics.median(run[1][i] for run in times)
        print(f"{clock}: C++ {cpp:.1f} ms, Python {python:.1f} ms, {python / cpp:.3f} times")


if __name__ == "__main__":
    main()
