# SPDX-License-Identifier: Apache-2.0
"""Entrants that do not do what they say:   cheat.py KIND TRACK ANSWER.csv

recorded:KNOWN  positions and times that were recorded on the known tracks, in the folder KNOWN
no_time         the right positions, as if they had taken no time
slow_kernel     as if the reference kernel took ten times as long as it does
unclocked       the right positions, computed before the clock is started
remembered      the same, but for a row that it has seen before in no time
backwards       the right positions, and forces that pull into the wall
"""

import pathlib
import sys
import time

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[4] / "bench" / "open"))

from files import ANSWER_COLUMNS, read_path  # noqa: E402
from truth import truth_of  # noqa: E402

USUAL_NS, KERNEL_NS = 500, 1800
UNCLOCKED_S = 4e-4  # of a frame


def write(file, times, proxies, forces, ns, reference_ns):
    rows = np.column_stack([times, proxies, forces, ns + np.arange(len(times)) % 40,
                            np.full(len(times), reference_ns)])  # fmt: skip
    np.savetxt(file, rows, "%.12g", ",", header=ANSWER_COLUMNS, comments="")


def main():
    kind, track, answer = sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3]
    times, probes = read_path(track)
    begins = times == 0
    if kind.startswith("recorded:"):
        known = pathlib.Path(kind.split(":", 1)[1]) / f"{track.name}.csv"
        rows = np.loadtxt(known, delimiter=",", skiprows=1)
        rows = rows[np.arange(len(times)) % len(rows)]
        rows[:, 0] = times
        np.savetxt(answer, rows, "%.12g", ",", header=ANSWER_COLUMNS, comments="")
        return
    proxies = truth_of(track).proxies(probes, begins)
    forces = 500 * (proxies - probes)
    ns, kernel_ns = USUAL_NS, KERNEL_NS
    if kind == "no_time":
        ns = 0
    elif kind == "slow_kernel":
        kernel_ns = 10 * KERNEL_NS
    elif kind in ("unclocked", "remembered"):
        worked = len(times) if kind == "unclocked" else len({tuple(p) for p in probes})
        end = time.process_time() + UNCLOCKED_S * worked
        while time.process_time() < end:
            pass
    elif kind == "backwards":
        forces = -forces
    write(answer, times, proxies, forces, ns, kernel_ns)


if __name__ == "__main__":
    main()
