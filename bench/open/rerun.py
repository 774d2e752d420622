# SPDX-License-Identifier: Apache-2.0
"""Runs an entrant once more on tracks that nobody has seen, and compares.

What each check catches, and what an honest entrant has to spare, is in docs/benchmark.md.
"""

import pathlib
import resource
import secrets
import shlex
import shutil
import subprocess
import tempfile
import time

import numpy as np

import tracks
from answers import ANSWER_COLUMNS, BadInput, read_rows

LEFT_OUT = 77  # exit status of an entrant that does not feel the track
WORSE, WORSE_UM = 3.0, 10.0  # fresh errors may be this many times the others', and this much more
SLOWER = 3.0  # a fresh time ratio may be this many times the recorded one
LEAST_RATIO = 0.02  # of the reference kernel; less is hardly more than reading a clock takes
REFERENCE_OFF = 4.0  # the entrant's reference_ns against ours
HIDDEN, HIDDEN_NS = 3.0, 50e3  # processor's time of a frame beyond what ns says
LONGER = 4  # times the path, to see what a frame takes
TIMEOUT_S = 1800
HERE = pathlib.Path(__file__).resolve().parent


def suspicions(command, seed, recorded, score):
    """A line for each thing that does not fit. `recorded`: scores by track."""
    seed = secrets.randbelow(2**31) + 2 if seed is None else seed
    if seed == tracks.FROZEN_SEED:
        raise BadInput(f"--seed {seed}: is the seed that everybody knows; give another one")
    words = shlex.split(command)
    if not words or not shutil.which(words[0]):
        raise BadInput(f'--rerun "{command}": "{words[0] if words else ""}" cannot be run; name a '
                       "program, with a path if it is not in PATH")  # fmt: skip
    print(f"rerun with seed {seed}")
    found = []
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        reference_ns = _reference_ns(folder)
        names = [name for name in recorded if name != "skull"]  # there is one skull only
        tracks.write_tracks(folder, seed, names)
        for name in names:
            found += _of_track(words, folder, name, recorded[name], score, reference_ns)
    return found


def _of_track(words, folder, name, recorded, score, reference_ns):
    try:
        cpu_ns, wall_ns = _run(words, folder / name, folder / "once.csv")
        fresh = score(folder / name, folder / "once.csv")
        _repeat(folder / name / "path.csv")
        longer_ns, _ = _run(words, folder / name, folder / "longer.csv")
    except BadInput as error:
        return [f"{name}: {error}"]
    rows = read_rows(folder / "once.csv", ANSWER_COLUMNS)
    claimed_ns, per_frame_ns = rows[:, 7:].sum(), (longer_ns - cpu_ns) / len(rows) / (LONGER - 1)
    found = [*_errors(recorded, fresh), *_times(recorded, fresh)]
    if claimed_ns > wall_ns:
        found.append(f"ns and reference_ns add up to {claimed_ns / 1e9:.3g} s, but the command "
                     f"ended after {wall_ns / 1e9:.3g} s")  # fmt: skip
    ratio = fresh["reference_ns_p50"] / reference_ns if reference_ns else 1.0
    if not 1 / REFERENCE_OFF < ratio < REFERENCE_OFF:
        found.append(f"its reference_ns is {ratio:.2g} times what the kernel takes here; compile "
                     "reference_kernel.c with -O2 and run it once after each frame")  # fmt: skip
    said_ns = claimed_ns / len(rows)
    if per_frame_ns - said_ns > HIDDEN_NS + HIDDEN * rows[:, 7].mean():
        found.append(f"a frame takes {per_frame_ns:.3g} ns of the processor, but ns and "
                     f"reference_ns say {said_ns:.3g}: work outside of the clock")  # fmt: skip
    return [f"{name}: {line}" for line in found]


def _errors(recorded, fresh):
    for column in ("level_rms_um", "position_rms_um"):
        before, now = recorded.get(column), fresh.get(column)
        if before is not None and now > WORSE * before + WORSE_UM:
            yield f"{column} is {now:.4g} on a fresh track, {before:.4g} on the known one"
    for column in ("fell_through_frames", "lost_frames"):
        before = recorded[column] / recorded["frames_in_contact"]
        now = fresh[column] / fresh["frames_in_contact"]
        if now > WORSE * before + 0.02:
            yield f"{column}: {now:.1%} of a fresh track, {before:.1%} of the known one"


def _times(recorded, fresh):
    before, now = recorded["time_ratio_p50"], fresh["time_ratio_p50"]
    for where, ratio in (("the known track", before), ("a fresh track", now)):
        if ratio < LEAST_RATIO:
            yield (f"on {where} a frame takes {ratio:.2g} of the reference kernel; less than "
                   f"{LEAST_RATIO} is hardly more than reading a clock takes")  # fmt: skip
    if now > SLOWER * max(before, LEAST_RATIO):
        yield f"a frame takes {now:.3g} of the reference kernel, {before:.3g} in the answer given"


def _run(words, track, answer):
    """Processor's and wall time of the command, ns."""
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter_ns()
    try:
        done = subprocess.run([*words, str(track), str(answer)], capture_output=True, text=True,
                              timeout=TIMEOUT_S, check=False)  # fmt: skip
    except subprocess.TimeoutExpired as error:
        raise BadInput(f"the command did not end within {TIMEOUT_S} s") from error
    except OSError as error:
        raise BadInput(f"the command cannot be run ({error})") from error
    wall, after = time.perf_counter_ns() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode or not answer.is_file():
        last = done.stderr.strip().splitlines()[-1:] or ["it said nothing"]
        raise BadInput(f"the command ended with {done.returncode} and wrote "
                       f"{'an' if answer.is_file() else 'no'} answer: {last[0]}")  # fmt: skip
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return 1e9 * cpu, wall


def _repeat(path):
    """The same trials again and again behind the path's own: the start of the program no longer
    counts in how much longer it takes."""
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:1] + LONGER * lines[1:]))


def _reference_ns(folder):
    """The kernel's time by our own measurement; None without a compiler."""
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if not compiler:
        print("rerun: no C compiler here: reference_ns is not compared")
        return None
    program = folder / "reference"
    subprocess.run([compiler, "-O2", "-DREFERENCE_MAIN", str(HERE / "reference_kernel.c"), "-o",
                    str(program), "-lm"], check=True)  # fmt: skip
    times = [float(subprocess.run([program], capture_output=True, check=True).stdout)
             for _ in range(3)]  # fmt: skip
    return float(np.median(times))
