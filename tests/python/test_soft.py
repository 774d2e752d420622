# SPDX-License-Identifier: Apache-2.0
"""Soft surfaces, and what lies beneath them, as Python says and asks them."""

import math
import unittest

import numpy as np
from support import cavity, main, strokes

import palpate

AFFINE = np.array(
    [[1e-3, 0, 0, -25e-3], [0, 1e-3, 0, -25e-3], [0, 0, 1e-3, -29.5e-3], [0, 0, 0, 1]]
)


def soft(**keys):
    """The cavity without friction, its wall with these keys."""
    scene = cavity(method="adaptive")
    scene["surface"]["wall"].update(keys)
    scene["effect"] = scene["effect"][:1]
    return scene


def organ():
    """A block of labels with its top at z = 0, and a ball of 5 mm in it, 3 mm deep."""
    i, j, k = np.mgrid[0:51, 0:51, 0:40]
    values = np.zeros((51, 51, 40), np.int32)
    values[5:46, 5:46, 5:30] = 1
    values[(i - 25) ** 2 + (j - 25) ** 2 + (k - 21.5) ** 2 <= 25.0] = 2
    return {
        "volume": {"v": palpate.Labels(np.asfortranarray(values), AFFINE, {1: "Organ", 2: "Lump"})},
        "surface": {
            "organ": {
                "volume": "v",
                "label": ["Organ", "Lump"],
                "stiffness_n_per_mm": 0.15,
                "beneath": {"Lump": 10.0},
                "contact_radius_mm": 5,
            }
        },
        "effect": [{"type": "surface", "surface": "organ"}],
    }


def skin(keys, bone=True, more=()):
    """A ball of 60 mm with these keys, alone or over a hard one of 40 mm."""
    scene = {
        "volume": {
            "skin": {"analytic": "solid_sphere", "radius_mm": 60},
            "bone": {"analytic": "solid_sphere", "radius_mm": 40},
        },
        "surface": {"skin": {"volume": "skin", **keys}},
        "effect": [{"type": "surface", "surface": "skin"}],
        "limits": {"force_n": 5.0, "slew_n_per_s": 1e7},
    }
    if bone:
        scene["surface"]["bone"] = {"volume": "bone"}
        scene["effect"].append({"type": "surface", "surface": "bone"})
    scene["effect"] += more
    return palpate.Scene(scene)


def at(depth_mm):
    """A place that deep in that ball."""
    return [60e-3 - 1e-3 * depth_mm, 0, 0]


class Layers(unittest.TestCase):
    def test_a_gain_leaves_its_strength_whatever_else_draws_the_tip(self):
        push = {"type": "constant_force", "force_n": [-3, 0, 0]}
        loop = palpate.Loop(skin({"stiffness_n_per_mm": 0.48}, more=[push]))
        loop.set_gain(0, 0.2)  # leaves 5 N * 0.2 / 0.8
        for _ in range(60):
            loop.frame(at(-8))
        for mm in np.arange(-8, 7, 0.3):
            self.assertLessEqual(loop.frame(at(mm)).force_n[0] + 3.0, 1.25 + 1e-3, mm)

    def test_a_wall_in_the_tissue_is_reached_at_once(self):
        # The tip is 0.25 mm deep at the table's first pair, and stops at 0.27 mm.
        table = [[3 / 0.48, 3.0], [40, 4.0]]
        wall = {"type": "workspace", "box_mm": [[60 - 0.27, -90, -90], [90, 90, 90]]}
        loop = palpate.Loop(skin({"stiffness_mm_n": table}, bone=False, more=[wall]))
        for mm in np.arange(-1, 14, 1.0):
            report = loop.frame(at(mm))
            self.assertNotIn("evaluation_cap", palpate.flag_names(report.flags), mm)

    def test_a_tip_that_has_left_a_slow_layer_touches_nothing(self):
        keys = {"stiffness_n_per_mm": 0.2, "press_damping_n_s_per_m": 6}
        loop = palpate.Loop(skin(keys))
        mm = -1.0
        while mm < 8:
            loop.frame(at(mm))
            mm += 0.1
        while loop.frame(at(mm)).felt:
            mm -= 0.2
        report = loop.frame(at(mm - 0.2))
        self.assertGreater(report.indentation_m, 0.0)
        self.assertEqual(loop.touches, [])
        self.assertEqual([of.standing for of in loop.surface_states], ["out", "out"])
        loop.adopt(skin(keys, bone=False))
        loop.frame(at(mm - 0.4))
        self.assertEqual(loop.touches, [])

    def test_in_silence_a_tissue_comes_back(self):
        keys = {"stiffness_n_per_mm": 0.1, "press_damping_n_s_per_m": 20}
        for bone in (False, True):
            loop = palpate.Loop(skin(keys, bone))
            loop.frame(at(-1))
            for i in range(400):
                loop.frame(at(min(8, 0.1 * i)))
            for _ in range(10):
                loop.frame([math.nan, 0, 0])
            loop.frame(at(-0.5))
            self.assertGreater(loop.frame(at(3)).force_n[0], 1.0, bone)


class SoftSurfaces(unittest.TestCase):
    def test_each_way_to_say_it_is_felt(self):
        said = {
            "stiffness_n_per_mm": ({"stiffness_n_per_mm": 0.2}, 200.0),
            "stiffness_mm_n": ({"stiffness_mm_n": [[2, 0.2], [4, 1.0]]}, 100.0),
            "youngs_kpa": ({"youngs_kpa": 9, "contact_radius_mm": 5}, 120.0),
        }
        for way, (keys, n_per_m) in said.items():
            with self.subTest(way):
                scene = palpate.Scene(soft(**keys, press_damping_n_s_per_m=2))
                at = scene.stiffness("wall", [[0.05, 0, 0], [0, 0.05, 0]])
                np.testing.assert_allclose(at, n_per_m, rtol=1e-12)
                softness = scene.plan()["surfaces"][0]["softness"]
                self.assertAlmostEqual(softness["stiffness_n_per_mm"], 1e-3 * n_per_m)
                self.assertEqual(softness["press_damping_n_s_per_m"], 2)
                self.assertTrue(softness["is_felt"] and softness["is_alone"])
                self.assertIsNone(scene.plan()["surfaces"][0]["beneath"])

    def test_a_dict_is_refused_in_the_words_of_a_file(self):
        refused = {
            "contact_radius_mm = 4 for a fingertip": {"youngs_kpa": 10},
            "is 0 N everywhere": {"stiffness_mm_n": [[2, 0]]},
            "stiffness_n_per_mm": {"stiffness_n_per_mm": -1},
            "is of what is soft": {"press_damping_n_s_per_m": 1},
            "the surface is not made of any": {"stiffness_n_per_mm": 0.1, "beneath": {"a": 2}},
        }
        for words, keys in refused.items():
            with self.subTest(words), self.assertRaises(palpate.SceneError) as raised:
                palpate.Scene(soft(**keys))
            self.assertIn(words, str(raised.exception))

    def test_what_lies_beneath_is_what_frames_feel(self):
        scene = palpate.Scene(organ())
        felt = scene.plan()["surfaces"][0]
        self.assertEqual(felt["beneath"]["ratios"], {"Lump": 10.0})
        self.assertEqual(felt["beneath"]["asked_contact_radius_mm"], 5.0)
        self.assertGreater(felt["beneath"]["stiffest"], 1.1)
        t = np.linspace(0.0, 1.0, 300)
        path = np.column_stack([-15e-3 + 30e-3 * t, 0 * t, np.maximum(2e-3 - 40e-3 * t, -2e-3)])
        trace = palpate.trace(scene, path)
        pressed = trace["indentation_m"] > 0
        self.assertGreater(pressed.sum(), 200)
        fronts = np.column_stack([trace[f"front_{axis}_m"] for axis in "xyz"])
        asked = scene.stiffness("organ", fronts[pressed])
        np.testing.assert_allclose(trace["stiffness_n_per_m"][pressed], asked, rtol=1e-12)
        self.assertGreater(asked.max() / asked.min(), 1.1)

    def test_the_front_of_what_is_hard_is_the_proxy(self):
        trace = palpate.trace(palpate.Scene(cavity()), strokes(500))
        self.assertEqual(trace["indentation_m"].max(), 0.0)
        for axis in "xyz":
            np.testing.assert_array_equal(trace[f"front_{axis}_m"], trace[f"proxy_{axis}_m"])

    def test_what_cannot_be_asked_is_refused(self):
        scene = palpate.Scene(soft(stiffness_n_per_mm=0.2))
        with self.assertRaises(KeyError):
            scene.stiffness("floor", [[0, 0, 0]])
        with self.assertRaises(palpate.ArgumentError):
            scene.stiffness("wall", [0, 0, 0])


if __name__ == "__main__":
    main()
