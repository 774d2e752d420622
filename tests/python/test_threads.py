# SPDX-License-Identifier: Apache-2.0
"""Long work lets other threads run, ends at Ctrl-C, and leaves no memory behind."""

import threading
import time
import unittest

from support import cavity, main, run_python, strokes

import palpate

_INTERRUPTED = """
import os, signal, threading, time
import numpy as np, palpate
from support import cavity, strokes
scene = palpate.Scene(cavity())
path = np.tile(strokes(100000), (10, 1))
began = threading.Event()
def stop():
    began.wait()
    time.sleep(0.2)
    os.kill(os.getpid(), signal.SIGINT)
thread = threading.Thread(target=stop)
thread.start()
try:
    began.set()
    palpate.trace(scene, path)
    print("not interrupted")
except KeyboardInterrupt:
    print("interrupted")
thread.join()
print(len(palpate.trace(scene, strokes(100))))
"""

_LEAK = """
import resource
import palpate
from support import cavity, strokes
def peak_kb():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
scene, path = palpate.Scene(cavity()), strokes(100000)
def work():
    trace = palpate.trace(scene, path)
    trace["felt"], trace.force_n
    loop = palpate.Loop(scene)
    for position in path[:20000]:
        loop.frame(position).force_n
    loop.restore(loop.save())
    for bad in ({"a": 1}, {"loop": {"method": "x"}}):
        try:
            palpate.Scene(bad)
        except palpate.SceneError:
            pass
for _ in range(3):
    work()
before = peak_kb()
for _ in range(6):
    work()
print(peak_kb() - before)
"""


_ENDS = """
import threading, time
import numpy as np, palpate
from support import cavity, strokes
scene, path = palpate.Scene(cavity()), np.tile(strokes(100000), (10, 1))
threading.Thread(target=palpate.trace, args=(scene, path), daemon=True).start()
time.sleep(0.2)
"""
_ADOPTS = """
import sys, threading, time
import palpate
from support import cavity
sys.setswitchinterval(1e-6)
many, few = cavity(), cavity()
for i in range(30):
    many["volume"][f"b{i}"] = {"analytic": "solid_sphere", "radius_mm": 5}
    many["surface"][f"b{i}"] = {"volume": f"b{i}"}
    many["effect"].append({"type": "surface", "surface": f"b{i}"})
del few["effect"][1]
many, few = palpate.Scene(many), palpate.Scene(few)
loop, end, seen = palpate.Loop(many), time.monotonic() + 2.0, set()
def scale():
    while time.monotonic() < end:
        try:
            loop.set_gain(31, 1.0)
        except Exception as error:
            seen.add(str(error))
thread = threading.Thread(target=scale)
thread.start()
while time.monotonic() < end:
    loop.adopt(few)
    loop.adopt(many)
thread.join()
print(" | ".join(sorted(seen)))
"""


class Threads(unittest.TestCase):
    def test_a_program_ends_while_a_daemon_thread_computes(self):
        outcome = run_python(_ENDS)
        self.assertEqual(outcome.returncode, 0, outcome.stderr)

    def test_a_gain_beside_a_scene_with_fewer_effects_is_refused(self):
        outcome = run_python(_ADOPTS)
        said = "effect = 31 is out of range; give an integer in [0, 0]\n"
        self.assertIn(outcome.stdout, (said, "\n"), outcome.stderr)

    def test_another_thread_runs_while_a_trace_is_computed(self):
        scene, path = palpate.Scene(cavity()), strokes(300000)
        turns, ended = [0], threading.Event()

        def turn():
            while not ended.is_set():
                turns[0] += 1
                time.sleep(0.001)  # and then it needs the interpreter's lock again

        thread = threading.Thread(target=turn)
        thread.start()
        before = turns[0]
        palpate.trace(scene, path)
        during = turns[0] - before
        ended.set()
        thread.join()
        # A trace that kept the lock would leave one turn, before it, and one after it.
        self.assertGreater(during, 10)

    def test_two_threads_trace_one_scene(self):
        scene, path = palpate.Scene(cavity()), strokes(20000)
        results = [None, None]

        def work(i):
            results[i] = palpate.trace(scene, path).force_n.tobytes()

        threads = [threading.Thread(target=work, args=(i,)) for i in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(results[0], results[1])
        self.assertEqual(results[0], palpate.trace(scene, path).force_n.tobytes())

    def test_ctrl_c_ends_a_trace_and_not_the_interpreter(self):
        outcome = run_python(_INTERRUPTED)
        self.assertEqual(outcome.stdout.split(), ["interrupted", "100"], outcome.stderr)
        self.assertEqual(outcome.returncode, 0)

    def test_a_hundred_thousand_frames_leave_no_memory_behind(self):
        outcome = run_python(_LEAK)
        self.assertEqual(outcome.returncode, 0, outcome.stderr)
        # One trace alone has 100,000 reports of 200 bytes and their inputs: some 40 MB.
        self.assertLess(int(outcome.stdout), 8000)


if __name__ == "__main__":
    main()
