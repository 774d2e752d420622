# SPDX-License-Identifier: Apache-2.0
"""A loop step by step gives the frames of a trace."""

import copy
import unittest

import numpy as np
from support import cavity, main, strokes

import palpate

_FIELDS = ("frame", "trial", "time_s", "sub_steps", "evaluations", "contacts", "residual_m")


class Loops(unittest.TestCase):
    def setUp(self):
        self.scene = palpate.Scene(cavity())

    def test_frames_are_those_of_a_trace(self):
        positions = strokes(3000)
        positions[1700] = np.inf
        for method in ("single", "fixed", "adaptive"):
            trace = palpate.trace(self.scene, positions, method=method)
            loop = palpate.Loop(self.scene, method=method)
            reports = [loop.frame(position) for position in positions]
            for name in (*_FIELDS, "flags", "surfaces_felt", "felt", "field_samples"):
                ours = np.array([getattr(report, name) for report in reports])
                self.assertEqual(ours.tolist(), trace[name].tolist(), name)
            for name in ("probe_m", "proxy_m", "force_n"):
                ours = np.array([getattr(report, name) for report in reports])
                self.assertEqual(ours.tobytes(), np.array(getattr(trace, name)).tobytes(), name)

    def test_new_trials_are_those_of_a_path(self):
        rows = np.column_stack([np.arange(40) / 1000.0, 1.05 * strokes(40)])
        trace = palpate.trace(self.scene, np.vstack([rows, rows]))
        loop = palpate.Loop(self.scene)
        reports = [
            loop.frame(row[1:], new_trial=row[0] == 0.0) for row in np.vstack([rows, rows])
        ]
        self.assertEqual([r.trial for r in reports], trace["trial"].tolist())
        self.assertEqual([tuple(r.force_n) for r in reports], [tuple(f) for f in trace.force_n])

    def test_time_may_be_the_callers(self):
        loop = palpate.Loop(self.scene)
        self.assertEqual(loop.frame((0, 0, 0), 12.5).time_s, 12.5)
        self.assertEqual(loop.frame((0, 0, 0)).time_s, 0.001)

    def test_a_restored_loop_goes_on_bit_for_bit(self):
        positions = strokes(2000)
        loop, other = palpate.Loop(self.scene), palpate.Loop(self.scene)
        for position in positions[:900]:
            loop.frame(position)
        state = loop.save()

        def rest(of):
            reports = [of.frame(position) for position in positions[900:]]
            return [(r.frame, r.time_s, *r.force_n, *r.proxy_m) for r in reports]

        first = rest(loop)
        self.assertGreater(max(abs(number) for row in first for number in row[2:5]), 0.5)
        loop.restore(state)
        self.assertEqual(rest(loop), first)
        other.restore(state)
        self.assertEqual(rest(other), first)

    def test_a_gain_of_zero_switches_an_effect_off_and_one_brings_it_back(self):
        loop = palpate.Loop(self.scene)
        outside = np.array([0.051, 0.0, 0.0])
        loop.frame([0.049, 0.0, 0.0])
        for _ in range(100):
            felt = loop.frame(outside)
        self.assertLess(felt.force_n[0], -0.4)
        loop.set_gain(0, 0.0)
        for _ in range(100):
            off = loop.frame(outside)
        self.assertAlmostEqual(off.force_n[0], 0.0, places=9)
        self.assertIn("live_gain", palpate.flag_names(off.flags))

    def test_what_is_pressed_is_named_beyond_the_surfaces_that_felt_names(self):
        scene = cavity(method="adaptive")
        scene["surface"]["wall"]["stiffness_n_per_mm"] = 0.2
        scene["effect"] = scene["effect"][:1]
        scene["volume"]["ball"] = {"analytic": "solid_sphere", "radius_mm": 10}
        for i in range(65):
            scene["surface"][f"far{i:02}"] = {"volume": "ball"}
            scene["effect"].append({"type": "surface", "surface": f"far{i:02}"})
        made = palpate.Scene(scene)
        loop = palpate.Loop(made)
        self.assertEqual(made.surfaces.index("wall"), 65)  # of `felt` there are 64
        loop.frame([0.049, 0.0, 0.0])
        for _ in range(20):
            report = loop.frame([0.052, 0.0, 0.0])
        self.assertGreater(report.indentation_m, 1e-4)
        self.assertEqual(report.pressed, "wall")

    def test_a_body_pushes_a_held_hand(self):
        moving = cavity()
        name = next(iter(moving["surface"]))
        moving["surface"][name]["moves"] = True
        loop = palpate.Loop(palpate.Scene(moving))
        loop.frame([0.0, 0.0, 0.0])
        for step in range(1, 521):  # the wall of the cavity comes from the left, by 52 mm
            loop.set_pose(name, [1e-4 * step, 0.0, 0.0])
            report = loop.frame([0.0, 0.0, 0.0])
        self.assertAlmostEqual(report.force_n[0], 500.0 * 0.002, places=3)
        position, orientation = loop.pose(0)
        np.testing.assert_array_equal(position, [1e-4 * 520, 0.0, 0.0])
        np.testing.assert_array_equal(orientation, [1.0, 0.0, 0.0, 0.0])
        force, torque = loop.wrench(name)
        np.testing.assert_allclose(force, -report.force_n, atol=1e-3)
        self.assertEqual(torque.shape, (3,))
        self.assertIn("body_moved", palpate.flag_names(report.flags))
        for wrong in (("nobody", [0, 0, 0]), (1, [0, 0, 0]), (0, [0, 0]), (0, [np.nan, 0, 0])):
            with self.assertRaises(palpate.ArgumentError):
                loop.set_pose(*wrong)
        with self.assertRaises(palpate.ArgumentError):
            palpate.Loop(self.scene).set_pose(0, [0, 0, 0])

    def test_another_scene_is_adopted(self):
        loop = palpate.Loop(self.scene)
        loop.frame([0.049, 0.0, 0.0])
        for _ in range(5):
            before = loop.frame([0.052, 0.0, 0.0])
        weaker = cavity()
        name = next(iter(weaker["surface"]))
        weaker["surface"][name]["strength_n"] = 0.5
        loop.adopt(palpate.Scene(weaker))
        first = loop.frame([0.052, 0.0, 0.0])
        self.assertEqual(first.frame, before.frame + 1)
        self.assertIn("scene_adopted", palpate.flag_names(first.flags))
        for _ in range(20):
            after = loop.frame([0.052, 0.0, 0.0])
        self.assertAlmostEqual(np.linalg.norm(after.force_n), 0.5, places=2)
        self.assertEqual(loop.touches[0].surface, name)
        other = cavity()
        other["limits"] = {"force_n": 3.0}
        with self.assertRaisesRegex(palpate.ArgumentError, "limits.force_n"):
            loop.adopt(palpate.Scene(other))

    def test_a_run_is_led_to_zero(self):
        loop = palpate.Loop(self.scene)
        loop.frame([0.049, 0.0, 0.0])
        for _ in range(100):
            loop.frame([0.052, 0.0, 0.0])
        lengths = [np.linalg.norm(loop.release()) for _ in range(50)]
        self.assertEqual(lengths[-1], 0.0)
        self.assertEqual(lengths, sorted(lengths, reverse=True))

    def test_a_frame_tells_its_proxys_way_and_its_steps(self):
        loop = palpate.Loop(self.scene, method="fixed", sub_steps=4)
        loop.frame([0.04, 0.0, 0.0])
        report = loop.frame([0.04, 0.004, 0.0])
        self.assertEqual(loop.path.shape[1], 3)
        np.testing.assert_array_equal(loop.path[-1], report.proxy_m)
        self.assertEqual(len(loop.steps_left), report.evaluations)
        self.assertEqual(loop.warnings, [])

    def test_a_loop_is_not_copied(self):
        for made in (copy.copy, copy.deepcopy):
            with self.assertRaisesRegex(TypeError, r"restore\(save\(\)\)"):
                made(palpate.Loop(palpate.Scene(cavity())))

    def test_a_gain_is_said_as_it_was_given(self):
        with self.assertRaisesRegex(palpate.ArgumentError, "gain = 10.0000001 is"):
            palpate.Loop(palpate.Scene(cavity())).set_gain(0, 10.0000001)


if __name__ == "__main__":
    main()
