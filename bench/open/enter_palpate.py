#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Enters Palpate, the methods that it compares itself with, and others, into one table.

    enter_palpate.py OPEN_PALPATE TRACKS TABLE.csv [--entry NAME ...] [--runs N]
                     [--also NAME=COMMAND ...]

OPEN_PALPATE: build/release/open_palpate. NAME: METHOD:CONTACT or a method of `palpate study`; all
of them by default. Of N runs (3) the one counts in which the reference kernel's median was the
least. COMMAND: another entrant, run as COMMAND TRACK ANSWER.csv. Beside the table,
TABLE.machine.json says on what machine the times were measured. Exit status: 0 done, 1 an entrant
failed (the table has the others), 2 wrong usage or input.
"""

import argparse
import json
import os
import pathlib
import platform
import shlex
import subprocess
import tempfile

from program import BadInput, check_writable, end_with, say, write_whole
from rerun import LEFT_OUT, words_of
from score import Track, score, write_rows
from tracks import TRACKS

ENTRIES = [f"{method}:{contact}" for contact in ("mesh", "volume")
           for method in ("single", "fixed", "paper", "adaptive")]  # fmt: skip
BUSY = 1.1  # a row's kernel may take this many times the least of the table
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


class EntrantFailed(Exception):
    """One line: who, on what track, and how."""


def answered(name, words, track, answer):
    """Whether the entrant has answered, or leaves the track out."""
    answer.unlink(missing_ok=True)
    done = subprocess.run([*words, str(track.folder), str(answer)], capture_output=True, text=True,
                          check=False)  # fmt: skip
    if done.returncode == LEFT_OUT:
        return False
    if done.returncode or not answer.is_file():
        last = done.stderr.strip().splitlines()[-1:] or ["it said nothing"]
        raise EntrantFailed(f"{name} on {track.folder.name} ended with {done.returncode} and wrote "
                            f"{'an' if answer.is_file() else 'no'} answer: {last[0]}")  # fmt: skip
    return True


def quietest(name, words, track, runs, answer):
    """The scores of the run in which the reference kernel's median was the least; None where the
    track is left out."""
    found = [score(track, answer) for _ in range(runs) if answered(name, words, track, answer)]
    return min(found, key=lambda columns: columns["reference_ns_p50"], default=None)


def say_where_it_was_busy(rows):
    """Names rows whose unit of time is not that of the others."""
    least = min(columns["reference_ns_p50"] for _, _, columns in rows)
    for name, track, columns in rows:
        ratio = columns["reference_ns_p50"] / least
        if ratio > BUSY:
            say(f"{name} on {track}: the kernel took {ratio:.2f} times its least; enter this again "
                "when the machine is quiet")  # fmt: skip


def run_count(text):
    """1 to 99."""
    if not text.isdecimal() or not 1 <= int(text) <= 99:
        raise argparse.ArgumentTypeError(f'"{text}" is no number from 1 to 99')
    return int(text)


def arguments():
    parser = argparse.ArgumentParser(description="Enters Palpate into the open benchmark.")
    parser.add_argument("open_palpate", type=pathlib.Path, metavar="OPEN_PALPATE",
                        help="the program, such as build/release/open_palpate")  # fmt: skip
    parser.add_argument("tracks", type=pathlib.Path, metavar="TRACKS", help="written by tracks.py")
    parser.add_argument("table", type=pathlib.Path, metavar="TABLE.csv",
                        help="gets the numbers; TABLE.machine.json the machine")  # fmt: skip
    parser.add_argument("--entry", nargs="+", default=ENTRIES, metavar="NAME",
                        help=f"these alone, of {', '.join(ENTRIES)}")  # fmt: skip
    parser.add_argument("--runs", type=run_count, default=3, metavar="N",
                        help="of each entry on each track, 1 to 99 (3)")  # fmt: skip
    parser.add_argument("--also", nargs="+", default=[], metavar="NAME=COMMAND",
                        help="other entrants, run as COMMAND TRACK ANSWER.csv")  # fmt: skip
    options = parser.parse_args()
    palpate = words_of(shlex.quote(str(options.open_palpate.resolve())), "OPEN_PALPATE")
    entrants = [(name, [*palpate, name]) for name in options.entry]
    for text in options.also:
        name, is_there, command = text.partition("=")
        if not is_there or not command:
            parser.error(f'--also "{text}": write NAME=COMMAND')
        entrants.append((name, words_of(command, "--also")))
    return options, entrants


def main():
    options, entrants = arguments()
    beside = options.table.with_suffix(".machine.json")
    for file in (options.table, beside):
        check_writable(file)
    tracks = {t: Track(options.tracks / t) for t in TRACKS if (options.tracks / t).is_dir()}
    if not tracks:
        raise BadInput(f"{options.tracks}: has no track; write them with tracks.py")
    description, rows, has_failed = machine(), [], False
    with tempfile.TemporaryDirectory() as folder:
        answer = pathlib.Path(folder) / "answer.csv"
        for name, words in entrants:
            for track_name, track in tracks.items():
                try:
                    columns = quietest(name, words, track, options.runs, answer)
                except (EntrantFailed, BadInput) as error:
                    say(error)
                    columns, has_failed = None, True
                if columns:
                    rows.append((name, track_name, columns))
            print(f"{name}: {sum(row[0] == name for row in rows)} tracks")
    if rows:
        write_rows(options.table, rows)
        write_whole(beside, json.dumps(description, indent=1) + "\n")
        say_where_it_was_busy(rows)
    return 1 if has_failed else 0


if __name__ == "__main__":
    end_with(main)
