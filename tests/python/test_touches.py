# SPDX-License-Identifier: Apache-2.0
"""What is touched: step by step, in a trace and in a recording."""

import tempfile
import unittest
from pathlib import Path

import numpy as np
from support import cavity, main, strokes

import palpate


class Touches(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scene = palpate.Scene(cavity())
        cls.positions = strokes(3000)
        cls.trace = palpate.trace(cls.scene, cls.positions)

    def test_a_trace_has_the_touches_of_its_frames(self):
        touches, loop = self.trace.touches, palpate.Loop(self.scene)
        rows = [
            (i, t.surface, t.phase, *t.point_m, *t.normal, *t.force_n)
            for i, position in enumerate(self.positions)
            if loop.frame(position)
            for t in loop.touches
        ]
        self.assertGreater(len(rows), 800)
        self.assertEqual(len(rows), len(touches))
        for i, name in enumerate(touches.columns):
            np.testing.assert_array_equal(touches[name], [row[i] for row in rows], name)
        np.testing.assert_array_equal(touches.force_n[:, 1], touches["force_y_n"])
        self.assertEqual(set(touches["phase"]), {"began", "goes_on", "ended"})

    def test_forces_of_the_touches_are_the_springs(self):
        # Away from frames that end early: 500 N/m from the probe to the proxy, to 0.1 um of way.
        touches, trace = self.trace.touches, self.trace
        total = np.zeros((len(trace), 3))
        np.add.at(total, touches["frame"], touches.force_n)
        felt = (trace["contacts"] > 0) & (trace["flags"] == 0)
        self.assertGreater(felt.sum(), 800)
        spring = 500.0 * (trace.proxy_m - trace.probe_m)
        np.testing.assert_allclose(total[felt], spring[felt], atol=500 * 1e-6)

    def test_a_recording_has_the_same_touches_but_no_voxels(self):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "recording.h5"
            self.trace.save(file)
            recording = palpate.read_recording(file)
        for name in self.trace.touches.columns:
            np.testing.assert_array_equal(recording.touches[name], self.trace.touches[name], name)
        self.assertEqual(recording.surfaces, ["wall"])
        with self.assertRaisesRegex(palpate.ArgumentError, "^labels: .*; replay it"):
            recording.touches.labels()
        self.assertEqual(set(self.trace.touches.labels()), {""})

    def test_columns_are_views_that_outlive_their_trace(self):
        trace = palpate.trace(self.scene, self.positions)
        point = trace.touches["point_x_m"]
        self.assertTrue(np.shares_memory(point, trace.touches.point_m))
        self.assertFalse(point.flags.writeable)
        del trace
        np.testing.assert_array_equal(point, self.trace.touches["point_x_m"])

    def test_states_say_how_the_proxy_stands(self):
        loop = palpate.Loop(self.scene)
        self.assertEqual(loop.surface_states, [])
        loop.frame([0.045, 0.0, 0.0])
        (state,) = loop.surface_states
        self.assertEqual((state.surface, state.standing, state.guarded), ("wall", "out", False))
        self.assertAlmostEqual(state.depth_m, -0.005, places=9)
        for _ in range(20):
            loop.frame([0.052, 0.0, 0.0])
        (state,) = loop.surface_states
        self.assertEqual(state.standing, "touched")
        self.assertLess(abs(state.depth_m), 1e-6)
        (touch,) = loop.touches
        self.assertEqual((touch.surface, touch.phase, touch.label), ("wall", "goes_on", ""))
        np.testing.assert_allclose(touch.normal, [-1.0, 0.0, 0.0], atol=1e-6)
        loop.frame([0.045, 0.0, 0.0])
        (touch,) = loop.touches
        self.assertEqual(touch.phase, "ended")
        self.assertEqual(touch.force_n.tolist(), [0.0, 0.0, 0.0])

    def test_no_touch_is_an_empty_table(self):
        touches = palpate.trace(self.scene, np.zeros((10, 3))).touches
        self.assertEqual(len(touches), 0)
        for name in touches.columns:
            self.assertEqual(len(touches[name]), 0)
        self.assertEqual(len(touches.labels()), 0)


if __name__ == "__main__":
    main()
