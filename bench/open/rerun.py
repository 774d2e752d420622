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

import tracks
from files import ANSWER_COLUMNS, read_rows
from program import BadInput, end_as_part

LEFT_OUT = 77  # exit status of an entrant that does not feel the track
WORSE = 3.0  # fresh errors may be this many times the others', and this much more:
MORE = {"level_rms_um": 10.0, "position_rms_um": 10.0, "force_error_rms_n": 0.005}
SLOWER = 2.0  # a fresh time ratio may be this many times the recorded one
LEAST_RATIO = 0.02  # of the reference kernel; less is hardly more than reading a clock takes
REFERENCE_OFF = 1.5  # the entrant's reference_ns against ours
HIDDEN, HIDDEN_NS = 3.0, 50e3  # processor's time of a frame beyond what ns says
LONGER = 4  # rounds of trials, all of them new, to see what a frame takes
LOOKS = 3  # a busy machine spoils one or two looks at times; who cheats is found by each
TIMEOUT_S = 1800
HERE = pathlib.Path(__file__).resolve().parent


def suspicions(command, seed, recorded, score):
    """A line for each thing that does not fit. `recorded`: scores by track."""
    seed = secrets.randbelow(2**31) + 2 if seed is None else seed
    if seed == tracks.FROZEN_SEED:
        raise BadInput(f"--seed {seed}: is the seed that everybody knows; give another one")
    words = words_of(command, "--rerun")
    names = [name for name in recorded if name != "skull"]  # there is one skull only
    if not names:
        raise BadInput("--rerun: only the skull is answered, of which there are no fresh tracks; "
                       "answer another track too")  # fmt: skip
    print(f"rerun with seed {seed}")
    found = []
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        kernel = _Kernel(folder)
        for name in names:
            for look in range(LOOKS):  # each on tracks of its own: nothing can be remembered
                if look:
                    print(f"{name}: {times[0]}; looked at again")
                wrong, times = _of_track(words, folder / str(look), name, seed + 1000 * look,
                                         recorded[name], score, kernel)  # fmt: skip
                if wrong or not times:
                    break
            found += [f"{name}: {line}" for line in wrong + times]
    return found


def words_of(command, option):
    """A command as words, of which the first one can be run."""
    try:
        words = shlex.split(command)
    except ValueError as error:
        raise BadInput(f'{option} "{command}": {error}; close it') from error
    if not words or not shutil.which(words[0]):
        raise BadInput(f'{option} "{command}": "{words[0] if words else ""}" cannot be run; name a '
                       "program, with a path if it is not in PATH")  # fmt: skip
    return words


def _of_track(words, folder, name, seed, recorded, score, kernel):
    """What is wrong whatever the machine does, and what is suspicious of the times: lines each.

    A round of fresh trials, then LONGER other ones on the same surface: the start of the program
    does not count in how much longer it takes, and no row comes twice."""
    runs = {"one round": range(1), f"{LONGER} rounds": range(1, 1 + LONGER)}
    wrong, off, cpu_ns, said_ns, frame_ns, frames = [], [], [], [], [], []
    for run, rounds in runs.items():
        out = folder / str(rounds.stop)
        tracks.write_track(out, name, seed, rounds=rounds)
        answer = out / f"{name}.csv"
        try:
            cpu, wall = _run(words, out / name, answer)
            fresh = score(out / name, answer)
        except BadInput as error:
            return [str(error)], []
        rows = read_rows(answer, ANSWER_COLUMNS)
        cpu_ns.append(cpu)
        said_ns.append(rows[:, 7:].sum())
        frame_ns.append(rows[:, 7].sum())
        frames.append(len(rows))
        wrong = wrong or [*_errors(recorded, fresh)]
        off.append([*_times(recorded, fresh), *kernel.differs(f"{name}, {run}", fresh)])
        if said_ns[-1] > wall:
            wrong.append(f"ns and reference_ns add up to {said_ns[-1] / 1e9:.3g} s, but the "
                         f"command ended after {wall / 1e9:.3g} s")  # fmt: skip
    times = off[0] if all(off) else []  # what a busy machine spoils is seldom each of the runs
    took, said, frame = ((b - a) / (frames[1] - frames[0]) for a, b in (cpu_ns, said_ns, frame_ns))
    if took - said > HIDDEN_NS + HIDDEN * frame:
        times.append(f"a frame takes {took:.3g} ns of the processor, but ns and reference_ns say "
                     f"{said:.3g}: work outside of the clock")  # fmt: skip
    return wrong, times


def _errors(recorded, fresh):
    for column, more in MORE.items():
        before, now = recorded.get(column), fresh.get(column)
        if before is not None and now > WORSE * before + more:
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


class _Kernel:
    """The reference kernel as compiled here, measured before and after each run of the entrant."""

    def __init__(self, folder):
        self.program = folder / "reference"
        self.before_ns = None
        compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
        words = [compiler, "-O2", "-DREFERENCE_MAIN", str(HERE / "reference_kernel.c"), "-o",
                 str(self.program), "-lm"]  # fmt: skip
        if compiler and not subprocess.run(words, capture_output=True, check=False).returncode:
            self.before_ns = self._ns()
        else:
            print("rerun: no C compiler here: reference_ns is not compared")

    def _ns(self):
        """The least median of three."""
        runs = [subprocess.run([self.program], capture_output=True, check=True) for _ in range(3)]
        return min(float(run.stdout) for run in runs)

    def differs(self, run, fresh):
        """Compares what the entrant's last run says of the kernel, and prints its time by ours."""
        if self.before_ns is None:
            return
        around = self.before_ns, self._ns()
        self.before_ns = around[1]
        print(f"{run}: a frame takes {fresh['time_ratio_p50']:.3g} of its own kernel, "
              f"{fresh['ns_p50'] / min(around):.3g} of the one measured here")  # fmt: skip
        said = fresh["reference_ns_p50"]
        if not min(around) / REFERENCE_OFF < said < max(around) * REFERENCE_OFF:
            yield (f"its reference_ns is {said / min(around):.2g} times what the kernel takes "
                   "here; call reference_ns() of reference_kernel.c, compiled with -O2, after each frame")


end_as_part(__name__, "score.py")
