#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Scores answers to the tracks of the open benchmark (docs/benchmark.md). Needs numpy alone.

    score.py TRACKS ANSWERS [--entry NAME] [--out TABLE.csv] [--rerun COMMAND [--seed N]]

ANSWERS/NAME.csv answers TRACKS/NAME. --rerun writes fresh tracks from a seed that nobody knew (or
from N), runs COMMAND TRACK ANSWER.csv on each, and compares: who has recorded his positions or his
times is found. Exit status: 0 scored, 1 the rerun found something, 2 wrong usage or input.
"""

import argparse
import csv
import io
import pathlib

from program import BadInput, check_writable, end_with, say, write_whole

import numpy as np

import rerun
from files import Answer, TrackFiles
from tracks import TRACKS, is_frozen
from truth import truth_of

INSIDE_M = 1e-4  # a proxy deeper than this has fallen into the material
ELSEWHERE_M = 1e-3  # as far from the right proxy, and
NEARER = 0.9  # within this share of its distance to the probe: it has passed the surface
FELT_N = 0.1  # a force that a hand can tell from none
NO_FORCE_M = 1e-9  # the right proxy is at the probe
LEAST = {"um": "1e-6", "n": "1e-9"}  # by unit, of what the decimals of entry.c's answer can say

COLUMNS = """frozen frames frames_in_contact level_rms_um level_p99_um level_max_um position_rms_um
position_p99_um position_max_um deepest_um fell_through_frames lost_frames ghost_frames
force_error_rms_n force_error_max_n force_jumps force_jump_max_n ns_p50 ns_p99 reference_ns_p50
reference_ns_p99 time_ratio_p50 time_ratio_p99""".split()


def percentile(values, share):
    """By nearest rank: a number that occurred."""
    return np.sort(values)[max(0, int(np.ceil(share * len(values))) - 1)]


def errors(name, distance_m):
    """rms, p99 and max of a distance, um."""
    um = 1e6 * distance_m
    values = np.sqrt((um**2).mean()), percentile(um, 0.99), um.max()
    return dict(zip((f"{name}_rms_um", f"{name}_p99_um", f"{name}_max_um"), values))


def norms(vectors):
    return np.linalg.norm(vectors, axis=1)


class Track(TrackFiles):
    """A track's files and what is right on it, computed once for all answers."""

    def __init__(self, folder):
        super().__init__(folder)
        self.stiffness = self.shape["stiffness_n_per_m"]
        self.is_frozen = is_frozen(folder)
        self.truth = truth_of(self)
        self._check_where_trials_begin()
        self.right = self.truth.proxies(self.probes, self.begins)
        if self.right is not None:
            self.away = norms(self.right - self.probes)
        else:  # the least that it can be
            self.away = np.maximum(0, -self.truth.signed_distance(self.probes))
        self.contact = self.away > NO_FORCE_M
        if not self.contact.any():
            raise BadInput(f"{folder / 'path.csv'}: the probe never touches the surface; write the "
                           "track anew with tracks.py")  # fmt: skip

    def _check_where_trials_begin(self):
        first = np.flatnonzero(self.begins)
        inside = first[self.truth.signed_distance(self.probes[first]) < -NO_FORCE_M]
        if len(inside):
            raise BadInput(f"{self.folder / 'path.csv'}:{inside[0] + 2}: a trial begins inside of "
                           "the material; begin it in free space")  # fmt: skip


def score(track, file):
    """The columns of an answer to a track. What cannot be known is left out."""
    answer = Answer(file, track.times)
    contact, right_force = track.contact, track.stiffness * track.away
    distance = track.truth.signed_distance(answer.proxies)
    force = norms(answer.forces)
    fell = contact & (distance < -INSIDE_M)
    result = {"frozen": int(track.is_frozen), "frames": len(track.times)}
    result["frames_in_contact"] = int(contact.sum())
    result |= errors("level", np.abs(distance[contact]))
    if track.right is not None:
        error = norms(answer.proxies - track.right)
        result |= errors("position", error[contact])
        nearer = norms(answer.proxies - track.probes) < NEARER * track.away
        fell |= contact & (error > ELSEWHERE_M) & nearer
        result["ghost_frames"] = int((~contact & (force > FELT_N)).sum())
        off = norms(answer.forces - track.stiffness * (track.right - track.probes))[contact]
        result["force_error_rms_n"] = np.sqrt((off**2).mean())
        result["force_error_max_n"] = off.max()
        jumps = force_jumps(answer.forces, track)
        result["force_jumps"] = int((jumps > FELT_N).sum())
        result["force_jump_max_n"] = max(0.0, jumps.max(initial=0.0))
    result["deepest_um"] = 1e6 * max(0.0, -distance.min())
    result["fell_through_frames"] = int(fell.sum())
    lost = contact & (right_force > FELT_N) & (force < right_force / 10)
    result["lost_frames"] = int(lost.sum())
    return result | times_of(answer, contact)


def score_once(folder, file):
    return score(Track(folder), file)


def force_jumps(forces, track):
    """How much more the force changes from frame to frame than the right one does, N."""
    changes = norms(np.diff(forces, axis=0))
    right = track.stiffness * norms(np.diff(track.right - track.probes, axis=0))
    return (changes - right)[~track.begins[1:]]


def times_of(answer, contact):
    """Of the frames in contact."""
    result = {}
    for name, every in (("ns", answer.ns), ("reference_ns", answer.reference_ns)):
        values = every[contact]
        result |= {f"{name}_p50": percentile(values, 0.5), f"{name}_p99": percentile(values, 0.99)}
    for p in ("p50", "p99"):  # both of the median, so that p99 is never less than p50
        result[f"time_ratio_{p}"] = result[f"ns_{p}"] / result["reference_ns_p50"]
    return result


def score_all(tracks, answers):
    """Scores by track, of those that are answered; what is left out is said on stderr."""
    for folder in (tracks, answers):
        if not folder.is_dir():
            raise BadInput(f"{folder}: is no folder; give TRACKS as tracks.py has written it, and "
                           "ANSWERS with a file such as plate.csv")  # fmt: skip
    scores = {}
    for name in TRACKS:
        if not (tracks / name).is_dir():
            say(f"{name}: left out: {tracks / name} is not there")
        elif not (answers / f"{name}.csv").is_file():
            say(f"{name}: left out: no {answers / name}.csv")
        else:
            scores[name] = score(Track(tracks / name), answers / f"{name}.csv")
            if not scores[name]["frozen"]:
                say(f"{name}: is not the frozen track, its numbers are not comparable; write it "
                    f"with tracks.py {tracks} --track {name}")  # fmt: skip
    if not scores:
        raise BadInput(f"{answers}: has no answer to a track of {tracks}; name it as the track, "
                       "such as plate.csv")  # fmt: skip
    return scores


def cell(value):
    return "" if value is None else str(value) if isinstance(value, int) else f"{value:.6g}"


def write_rows(out, rows):
    """The table: (entry, track, scores) each."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["entry", "track", *COLUMNS])
    for entry, track, columns in rows:
        table.writerow([entry, track, *(cell(columns.get(c)) for c in COLUMNS)])
    write_whole(out, text.getvalue())


def shown(column, value):
    """A cell as it is printed: of what is less than an answer can say, only that it is so."""
    least = LEAST.get(column.rsplit("_", 1)[-1], "0")
    return f"< {least}" if value and 0 < value < float(least) else cell(value)


def print_scores(scores):
    columns = ["level_rms_um", "position_rms_um", "position_p99_um", "deepest_um",
               "fell_through_frames", "lost_frames", "ghost_frames", "force_error_rms_n",
               "force_jumps", "time_ratio_p50"]  # fmt: skip
    print("track".ljust(12) + "".join(c.rjust(max(12, len(c) + 2)) for c in columns))
    for name, found in scores.items():
        values = (shown(c, found.get(c)).rjust(max(12, len(c) + 2)) for c in columns)
        print(name.ljust(12) + "".join(values))


def main():
    parser = argparse.ArgumentParser(description="Scores answers to the open benchmark.")
    parser.add_argument("tracks", type=pathlib.Path, metavar="TRACKS", help="written by tracks.py")
    parser.add_argument("answers", type=pathlib.Path, metavar="ANSWERS",
                        help="a folder: NAME.csv answers TRACKS/NAME")  # fmt: skip
    parser.add_argument("--entry", default="entry", metavar="NAME", help="in the table (entry)")
    parser.add_argument("--out", type=pathlib.Path, metavar="TABLE.csv", help="all columns")
    parser.add_argument("--rerun", metavar="COMMAND", help="run as COMMAND TRACK ANSWER.csv")
    parser.add_argument("--seed", type=int, metavar="N",
                        help="of the fresh tracks; default: by chance")  # fmt: skip
    options = parser.parse_args()
    if options.seed is not None and options.rerun is None:
        parser.error("--seed is of --rerun; give both")
    if options.out:
        check_writable(options.out)
    scores = score_all(options.tracks, options.answers)
    print_scores(scores)
    if options.out:
        write_rows(options.out, [(options.entry, *row) for row in scores.items()])
    if options.rerun is None:
        return 0
    found = rerun.suspicions(options.rerun, options.seed, scores, score_once)
    for line in found:
        say(line)
    many = "1 suspicion" if len(found) == 1 else f"{len(found)} suspicions"
    print(f"rerun: {many}" if found else "rerun: nothing suspicious")
    return 1 if found else 0


if __name__ == "__main__":
    end_with(main)
