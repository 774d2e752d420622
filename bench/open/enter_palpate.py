#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Enters Palpate, the methods that it compares itself with, and others, into one table.

    enter_palpate.py OPEN_PALPATE TRACKS TABLE.csv [--entry NAME ...] [--runs N]
                     [--also NAME=COMMAND ...]

OPEN_PALPATE: build/release/open_palpate. NAME: METHOD:CONTACT or a method of `palpate study`; all
of them by default. Of N runs (3) the one counts in which the machine was the quietest. COMMAND:
another entrant, run as COMMAND TRACK ANSWER.csv. Beside the table,
TABLE.machine.json says on what machine the times were measured. Exit status: 0 done, 1 an entrant
failed, 2 wrong usage or input.
"""

import argparse
import json
import os
import pathlib
import platform
import shlex
import shutil
import subprocess
import sys
import tempfile

from answers import BadInput
from rerun import LEFT_OUT
from score import Track, score, write_rows
from tracks import TRACKS

ENTRIES = [f"{method}:{contact}" for contact in ("mesh", "volume")
           for method in ("single", "fixed", "paper", "adaptive")]  # fmt: skip
ENTRIES += ["penalty", "god_object", "virtual_proxy", "linear", "ikits", "primitives", "subdivided"]


def value_of(file, key, mark):
    """What follows a key in a file of the system; nothing where there is none."""
    file = pathlib.Path(file)
    lines = file.read_text().splitlines() if file.is_file() else []
    pairs = (line.partition(mark)[::2] for line in lines)
    return next((value.strip(' "') for name, value in pairs if name.strip() == key), "")


def machine():
    """What times depend on."""
    return {
        "cpu": value_of("/proc/cpuinfo", "model name", ":") or platform.machine(),
        "cores": os.cpu_count(),
        "system": value_of("/etc/os-release", "PRETTY_NAME", "=") or platform.system(),
        "kernel": platform.release(),
        "load_1_min": round(os.getloadavg()[0], 2),
    }


def answered(name, words, track, answer):
    """Whether the entrant has answered, or leaves the track out. SystemExit(1) where it fails."""
    done = subprocess.run([*words, str(track.folder), str(answer)], capture_output=True, text=True,
                          check=False)  # fmt: skip
    if done.returncode == LEFT_OUT:
        return False
    if done.returncode or not answer.is_file():
        print(f"enter_palpate.py: {name} on {track.folder.name} ended with {done.returncode}: "
              f"{done.stderr.strip()}", file=sys.stderr)  # fmt: skip
        raise SystemExit(1)
    return True


def enter(name, words, tracks, runs, folder):
    """Rows (entry, track, scores) of one entrant: of the run in which the machine was the quietest,
    by the reference kernel's 99th percentile."""
    answer = folder / "answer.csv"
    for track_name, track in tracks.items():
        found = [score(track, answer) for _ in range(runs) if answered(name, words, track, answer)]
        if found:
            yield name, track_name, min(found, key=lambda columns: columns["reference_ns_p99"])


def main():
    parser = argparse.ArgumentParser(description="Enters Palpate into the open benchmark.")
    parser.add_argument("open_palpate", type=pathlib.Path, metavar="OPEN_PALPATE")
    parser.add_argument("tracks", type=pathlib.Path, metavar="TRACKS")
    parser.add_argument("table", type=pathlib.Path, metavar="TABLE.csv")
    parser.add_argument("--entry", nargs="+", default=ENTRIES, metavar="NAME")
    parser.add_argument("--runs", type=int, choices=range(1, 100), default=3, metavar="N")
    parser.add_argument("--also", nargs="+", default=[], metavar="NAME=COMMAND")
    options = parser.parse_args()
    entrants = [(name, [str(options.open_palpate.resolve()), name]) for name in options.entry]
    for text in options.also:
        name, is_there, command = text.partition("=")
        if not is_there or not command:
            parser.error(f'--also "{text}": write NAME=COMMAND')
        entrants.append((name, shlex.split(command)))
    for _, words in entrants:
        if not shutil.which(words[0]):
            parser.error(f"{words[0]}: cannot be run; build it, or name a program that is there")
    description, rows = machine(), []
    try:
        tracks = {t: Track(options.tracks / t) for t in TRACKS if (options.tracks / t).is_dir()}
        if not tracks:
            raise BadInput(f"{options.tracks}: has no track; write them with tracks.py")
        with tempfile.TemporaryDirectory() as folder:
            for name, words in entrants:
                rows += enter(name, words, tracks, options.runs, pathlib.Path(folder))
                print(f"{name}: {sum(row[0] == name for row in rows)} tracks")
    except (BadInput, OSError) as error:
        print(f"enter_palpate.py: {error}", file=sys.stderr)
        return 2
    write_rows(options.table, rows)
    beside = options.table.with_suffix(".machine.json")
    beside.write_text(json.dumps(description, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
