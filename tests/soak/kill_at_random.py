#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Kills the command with SIGKILL at a random moment, many times, and looks at what it left behind.

  kill_at_random.py PALPATE SCENE.toml [TIMES] [SEED]

In turns a trace at pace asap, one in real time, and the report of a recording are killed. Afterwards no file may be half-written:
tables end with a whole line, JSON and HTML are whole, a recording is there and replays, or is not there, and a journal replays as a
run that was cut off. Then the same command, not killed, must do its work over what is left. Exit 1 at the first file that is not so.
"""
import json
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time


def run(palpate, *options, folder):
    return subprocess.run([palpate, *options], cwd=folder, capture_output=True, text=True, check=False)


def fail(words, folder):
    sys.exit(f"kill_at_random: {words}; see {folder}")


def check_file(palpate, file, folder):
    """A file under its own name is whole."""
    if file.suffix == ".json":
        json.loads(file.read_text())
    elif file.suffix == ".csv" and not file.read_text().endswith("\n"):
        fail(f"{file.name} ends within a line", folder)
    elif file.suffix == ".html" and "</html>" not in file.read_text()[-200:]:
        fail(f"{file.name} is cut", folder)
    elif file.suffix in (".h5", ".part"):
        replayed = run(palpate, "replay", str(file), "--check", folder=folder)
        cut_off = "cut off" in replayed.stderr
        # A journal may have been killed before its first part.
        is_empty = file.suffix == ".part" and "nothing was kept" in replayed.stderr
        if not is_empty and (replayed.returncode != 0 or cut_off != (file.suffix == ".part")):
            fail(f"{file.name}: replay says {replayed.returncode}: {replayed.stdout}{replayed.stderr}", folder)


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    palpate, scene = (str(pathlib.Path(file).resolve()) for file in sys.argv[1:3])
    times = int(sys.argv[3]) if len(sys.argv) > 3 else 100
    rng = random.Random(int(sys.argv[4]) if len(sys.argv) > 4 else 1)
    folder = pathlib.Path(tempfile.mkdtemp(prefix="palpate-kill-"))
    kinds = [("trace", scene, "--out", "asap"),
             ("trace", scene, "--out", "realtime", "--pace", "realtime", "--seconds", "2"),
             ("report", "whole", "--out", "report.html")]
    whole = run(palpate, "trace", scene, "--out", "whole", "--seconds", "2", folder=folder)
    if whole.returncode != 0:
        fail(f"the scene is not traced: {whole.stderr}", folder)
    lasts_s = []
    for kind in kinds:  # how long each takes, so that a moment within it is hit
        begun = time.monotonic()
        ended = run(palpate, *kind, folder=folder)
        if ended.returncode != 0:
            fail(f"{' '.join(kind)}: {ended.stderr}", folder)
        lasts_s.append(time.monotonic() - begun)
    killed = 0
    for turn in range(times):
        which = turn % len(kinds)
        with subprocess.Popen([palpate, *kinds[which]], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as child:
            time.sleep(rng.uniform(0.0, 1.1 * lasts_s[which]))
            child.send_signal(signal.SIGKILL)
            killed += child.wait() == -signal.SIGKILL
        for file in sorted(folder.rglob("*")):
            if file.is_file() and not file.name.startswith("."):
                check_file(palpate, file, folder)
    left = [str(file.relative_to(folder)) for file in folder.rglob(".*") if file.is_file()]
    for kind in kinds:
        ended = run(palpate, *kind, folder=folder)
        if ended.returncode != 0:
            fail(f"{' '.join(kind)} does not go over what is left: {ended.stderr}", folder)
    print(f"{times} runs, {killed} of them killed: nothing half-written, all done again; temporary files left: {len(left)}")


if __name__ == "__main__":
    main()
