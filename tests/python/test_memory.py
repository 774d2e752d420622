# SPDX-License-Identifier: Apache-2.0
"""Arrays are a scene's data: felt as those in a file are, not copied, kept as long as needed."""

import copy
import gc
import gzip
import importlib.util
import os
import pickle
import re
import tempfile
import unittest
import weakref
from pathlib import Path

import numpy as np
from support import ROOT, main, run_command, run_python

import palpate
from palpate.runs import Frames

_BY_THE_CLOCK = ("spent_us", "estimate_us", "late_us")
CAN_EXTRACT = importlib.util.find_spec("palpate._extraction") is not None
AFFINE = np.diag([1e-3, 1e-3, 1e-3, 1.0])
AFFINE[:3, 3] = -0.0315


def radius_mm(shape=(64, 64, 64), affine=AFFINE):
    """Distance of each voxel's centre from the scene's origin, mm."""
    index = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)
    return 1e3 * np.linalg.norm(index @ affine[:3, :3].T + affine[:3, 3], axis=-1)


def ball(radius=20.0):
    """Voxels of a ball, whose values grow inwards."""
    return palpate.Voxels(np.asfortranarray(radius - radius_mm(), dtype=np.float32), AFFINE)


def halves():
    """Labels of a ball of 20 mm: its left and its right half."""
    values = np.where(radius_mm() < 20.0, 1, 0).astype(np.int32, order="F")
    values[32:][values[32:] == 1] = 2
    return palpate.Labels(values, AFFINE, {1: "right half", 2: "left half"})


def scene_of(volume, **surface):
    return {
        "volume": {"scan": volume},
        "surface": {"skin": {"volume": "scan", **surface}},
        "effect": [{"type": "surface", "surface": "skin"}],
    }


def over_the_top(count=600):
    """Positions (count, 3), m, that stroke the ball from its right to its left, 2 mm deep."""
    angle = np.linspace(-0.8, 0.8, count)
    press = np.minimum(np.arange(count) / 100.0, 1.0)
    radius = 0.021 - 0.003 * press
    return np.column_stack([radius * np.sin(angle), 0.0 * angle, radius * np.cos(angle)])


def octahedron(radius_m):
    corners = np.vstack([np.eye(3), -np.eye(3)]) * radius_m
    faces = [(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5), (0, 4, 5)]
    return palpate.Mesh(corners, np.array(faces, dtype=np.uint32))


class Memory(unittest.TestCase):
    def assert_same(self, one, other, but=_BY_THE_CLOCK):
        for name in Frames.columns:
            if name not in but:
                np.testing.assert_array_equal(one[name], other[name], name)
        for name in one.touches.columns:
            np.testing.assert_array_equal(one.touches[name], other.touches[name], name)

    def test_voxels_are_felt_as_the_same_voxels_in_a_file_bit_for_bit(self):
        with tempfile.TemporaryDirectory() as folder:
            said = run_command("phantom", "phantom.nrrd", cwd=folder)
            self.assertEqual(said.returncode, 0, said.stderr)
            file = Path(folder) / "phantom.nrrd"
            header, _, data = file.read_bytes().partition(b"\n\n")
            fields = dict(
                line.split(": ", 1) for line in header.decode().splitlines() if ": " in line
            )
            said = [fields[key] for key in ("type", "encoding", "endian", "space")]
            self.assertEqual(said, ["float", "gzip", "little", "left-posterior-superior"])
            shape = tuple(map(int, fields["sizes"].split()))
            columns = [
                [float(x) for x in vector.strip("()").split(",")]
                for vector in fields["space directions"].split()
            ]
            affine = np.eye(4)
            affine[:3, :3] = 1e-3 * np.array(columns).T
            origin = fields["space origin"].strip("()").split(",")
            affine[:3, 3] = [1e-3 * float(x) for x in origin]
            values = np.frombuffer(gzip.decompress(data), dtype="<f4").reshape(shape, order="F")
            surface = {"iso_value": 226.0, "smooth_voxels": 0.7}
            device = {"type": "orbit", "duration_s": 0.5}
            of_file = {**scene_of({"file": os.fspath(file)}, **surface), "device": device}
            in_memory = palpate.Voxels(values, affine)
            ours = palpate.Scene({**scene_of(in_memory, **surface), "device": device})
            theirs = palpate.Scene(of_file)
        ours_felt, theirs_felt = palpate.trace(ours), palpate.trace(theirs)
        self.assertGreater((ours_felt["felt"] == "skin").sum(), 200)
        self.assert_same(ours_felt, theirs_felt)
        if CAN_EXTRACT:
            for mine, other in zip(ours.mesh("skin"), theirs.mesh("skin")):
                np.testing.assert_array_equal(mine, other)

    def test_no_array_of_a_volume_is_copied(self):
        # 64 MB: a scene that feels a part of it alone has room for much less.
        program = """
import resource
import numpy as np, palpate
from test_memory import AFFINE, radius_mm
def peak_mb():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
values = np.zeros((256, 256, 256), dtype=np.float32, order="F")
values[:64, :64, :64] = 20.0 - radius_mm()
values[64:] = values[:, 64:] = values[:, :, 64:] = -20.0
before = peak_mb()
voxels = palpate.Voxels(values, AFFINE)
voxels.sha256
assert np.shares_memory(voxels.values, values)
print(peak_mb() - before)
region = [[-25, -25, -25], [25, 25, 25]]
scene = palpate.Scene({
    "volume": {"scan": voxels},
    "surface": {"skin": {"volume": "scan", "iso_value": 0, "region_mm": region}},
    "effect": [{"type": "surface", "surface": "skin"}],
}, extraction=False)
felt = palpate.trace(scene, [[0, 0, 0.021]] * 10 + [[0, 0, 0.018]] * 40).force_n
assert felt[-1][2] > 0.5, felt[-1]
print(peak_mb() - before)
"""
        outcome = run_python(program)
        self.assertEqual(outcome.returncode, 0, outcome.stderr)
        hashed, felt = map(float, outcome.stdout.split())
        self.assertLess(hashed, 16.0)
        self.assertLess(felt, 48.0)

    def test_arrays_live_as_long_as_what_feels_them_and_no_longer(self):
        voxels = ball()
        array = weakref.ref(voxels.values)
        scene = palpate.Scene(scene_of(voxels, iso_value=0.0), extraction=False)
        trace = palpate.trace(scene, over_the_top(50))
        loop = palpate.Loop(scene)
        del voxels, scene
        gc.collect()
        self.assertIsNotNone(array())
        trace.summary()
        del loop
        gc.collect()
        self.assertIsNotNone(array())
        del trace
        gc.collect()
        self.assertIsNone(array())

    def test_an_array_nobody_else_keeps_stays_what_it_was(self):
        def made():
            return palpate.Scene(scene_of(ball(), iso_value=0.0), extraction=False)

        scene = made()
        trace = palpate.trace(scene, over_the_top(5))
        for _ in range(20):
            np.full((64, 64, 64), 7.0, dtype=np.float32)  # takes freed memory, if there is any
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "recording.h5"
            trace.save(file)
            self.assertEqual(palpate.read_recording(file).sources[0].sha256, ball().sha256)

    def test_labels_are_surfaces_and_are_told_where_they_are_touched(self):
        scene = palpate.Scene(scene_of(halves(), label=["left half", "right half"]))
        trace = palpate.trace(scene, over_the_top())
        labels = trace.touches.labels()
        self.assertEqual(set(labels), {"left half", "right half"})
        # The hand goes from x < 0, the patient's right, to x > 0; the names may be each other's
        # within a voxel of where the halves meet.
        x_m = trace.touches["point_x_m"]
        self.assertEqual(set(labels[x_m < -1.1e-3]), {"right half"})
        self.assertEqual(set(labels[x_m > 1.1e-3]), {"left half"})
        loop = palpate.Loop(scene)
        for position in over_the_top()[:200]:
            loop.frame(position)
        self.assertEqual([touch.label for touch in loop.touches], ["right half"])

    def test_layers_overlap_and_what_has_no_name_is_called_by_its_number(self):
        inner, outer = (
            np.where(radius_mm() < r, value, 0).astype(np.int32, order="F")
            for r, value in ((10.0, 3), (20.0, 3))
        )
        labels = palpate.Labels([inner, outer], AFFINE, [{3: "core"}, {}])
        scene = palpate.Scene(
            {
                "volume": {"scan": labels},
                "surface": {n: {"volume": "scan", "label": n} for n in ("core", "3")},
                "effect": [{"type": "surface", "surface": n} for n in ("core", "3")],
            },
            extraction=False,
        )
        self.assertEqual(scene.surfaces, ["3", "core"])
        trace = palpate.trace(scene, over_the_top())
        self.assertEqual(set(trace.touches["surface"]), {"3"})

    def test_values_of_one_name_are_one_surface_and_may_be_negative(self):
        values = np.where(radius_mm() < 20.0, -1, 0).astype(np.int32, order="F")
        values[32:][values[32:] == -1] = 2
        labels = palpate.Labels(values, AFFINE, {-1: "ball", 2.0: "ball", 0: "air"})
        trace = palpate.trace(palpate.Scene(scene_of(labels, label="ball")), over_the_top())
        self.assertEqual(set(trace.touches.labels()), {"ball"})
        whole = palpate.trace(palpate.Scene(scene_of(halves(), label=["1", "2"])), over_the_top())
        np.testing.assert_array_equal(trace.force_n, whole.force_n)

    def test_vectors_push_along_their_own_axes(self):
        values = np.zeros((3, 4, 5, 6), dtype=np.float32, order="F")
        values[1] = 1.0  # to the back, wherever the hand is
        affine = np.diag([0.02, 0.02, 0.02, 1.0])
        flow = palpate.Vectors(values, affine)
        push = {"type": "vector_force", "volume": "flow", "strength_n": 0.5}
        scene = palpate.Scene({"volume": {"flow": flow}, "effect": [push]})
        trace = palpate.trace(scene, [[0.03, 0.03, 0.03]] * 60)
        # 500 N/m, and a proxy that is right to 0.1 um.
        np.testing.assert_allclose(trace.force_n[-1], [0.0, 0.5, 0.0], atol=5e-5)

    def test_a_mesh_is_felt_and_distances_from_it_are_exact(self):
        scene = palpate.Scene(
            {
                "surface": {"gem": {"mesh": octahedron(0.02)}},
                "effect": [{"type": "surface", "surface": "gem"}],
            }
        )
        np.testing.assert_array_equal(scene.mesh("gem").triangles, octahedron(0.02).triangles)
        across = np.array([1.0, 1.0, 1.0]) / np.sqrt(3.0)
        plane = 0.02 / np.sqrt(3.0)  # from the origin to each face
        path = np.outer(np.linspace(plane + 2e-3, plane - 2e-3, 200), across)
        trace = palpate.trace(scene, path)
        np.testing.assert_allclose(trace.force_n[-1], 500 * 2e-3 * across, atol=1e-3)
        points = np.array([(plane + 5e-3) * across, (plane - 5e-3) * across, [np.nan, 0, 0]])
        nearest = palpate.SurfaceDistance(scene, "gem").nearest(points)
        np.testing.assert_allclose(nearest.distance_m[:2], [5e-3, -5e-3], atol=1e-15)
        np.testing.assert_allclose(nearest.position_m[:2], [plane * across] * 2, atol=1e-15)
        np.testing.assert_allclose(nearest.normal[:2], [across] * 2, atol=1e-15)
        self.assertEqual(nearest.sign_known.tolist(), [True, True, False])
        self.assertTrue(np.isnan(nearest.distance_m[2]) and np.isnan(nearest.position_m[2]).all())

    def test_distances_from_voxels_are_those_of_the_ball(self):
        scene = palpate.Scene(scene_of(ball(), iso_value=0.0), extraction=False)
        points = over_the_top(20) * 1.2
        nearest = palpate.SurfaceDistance(scene, "skin").nearest(points)
        wanted = np.linalg.norm(points, axis=1) - 0.02
        # Voxels of 1 mm on a ball of 20 mm: a chord is h^2 / 8 R = 6 um off, in three directions.
        np.testing.assert_allclose(nearest.distance_m, wanted, atol=2e-5)

    def test_a_recording_says_what_it_needs_and_takes_it_from_the_program(self):
        description = scene_of(ball(), iso_value=0.0)
        scene = palpate.Scene(description, extraction=False)
        for changes in ({}, {"method": "fixed", "sub_steps": 3}):
            trace = palpate.trace(scene, over_the_top(), **changes)
            self.assertGreater((trace["felt"] == "skin").sum(), 200)
            with tempfile.TemporaryDirectory() as folder:
                file = Path(folder) / "recording.h5"
                trace.save(file)
                recording = palpate.read_recording(file)
                self.assertEqual(recording.scene_text, "")
                self.assertEqual(
                    recording.sources[0],
                    ('volumes["scan"].voxels, 64 x 64 x 64', description["volume"]["scan"].sha256),
                )
                elsewhere = palpate.Scene(scene_of(ball(), iso_value=0.0), extraction=False)
                again = palpate.replay(recording, elsewhere, extraction=False)
                self.assert_same(again, trace)
                np.testing.assert_array_equal(again.touches["frame"], recording.touches["frame"])
                with self.assertRaisesRegex(palpate.ArgumentError, "^scene: is None.*; give"):
                    palpate.replay(recording)
                other = palpate.Scene(scene_of(ball(20.5), iso_value=0.0), extraction=False)
                refusal = r'volumes\["scan"\].voxels.* SHA-256'
                with self.assertRaisesRegex(palpate.FileError, refusal):
                    palpate.replay(file, other, extraction=False)
                said = run_command("replay", file, "--check", cwd=folder)
                self.assertEqual(said.returncode, 3, said.stdout)

    def test_a_scene_of_arrays_comes_back_from_its_description(self):
        description = scene_of(ball(), iso_value=0.0)
        description["surface"]["gem"] = {"mesh": octahedron(0.005), "contact": "mesh"}
        description["effect"].append({"type": "surface", "surface": "gem"})
        scene = palpate.Scene(description, extraction=False)
        self.assertIs(scene.description["volume"]["scan"], description["volume"]["scan"])
        again = palpate.Scene(scene.description, extraction=False)
        self.assertEqual(scene.text, again.text)
        self.assertIn('["volume"."scan"]  # voxels, 64 x 64 x 64, in memory\n', scene.text)
        path = over_the_top(100)
        self.assert_same(palpate.trace(scene, path), palpate.trace(again, path))

    def test_an_affine_of_ras_and_mm_is_turned_into_the_scene(self):
        ras = np.array([[-0.7, 0.1, 0, 90.0], [0, 0.8, 0, -126], [0, 0.2, 1.1, -72], [0, 0, 0, 1]])
        scene = palpate.affine_from_ras_mm(ras)
        index = np.array([3.0, 5.0, 7.0, 1.0])
        right, front, up = (ras @ index)[:3]
        np.testing.assert_allclose((scene @ index)[:3], [-right / 1e3, -front / 1e3, up / 1e3])
        with self.assertRaisesRegex(palpate.ArgumentError, "^affine: "):
            palpate.affine_from_ras_mm(np.eye(3))


class Copies(unittest.TestCase):
    def test_arrays_are_copied_and_sent_to_other_processes(self):
        for data in (ball(), halves()):
            for made in (copy.deepcopy(data), pickle.loads(pickle.dumps(data))):
                self.assertEqual(made.sha256, data.sha256)
                self.assertEqual(repr(made), repr(data))

    @unittest.skipUnless(CAN_EXTRACT, "this build of the package makes no meshes of volumes")
    def test_a_recording_is_replayed_with_its_own_scene(self):
        scene = palpate.Scene(scene_of(ball(), iso_value=0.0), extraction=False)
        trace = palpate.trace(scene, over_the_top(50))
        with tempfile.TemporaryDirectory() as folder:
            trace.save(Path(folder) / "r.h5")
            again = palpate.replay(Path(folder) / "r.h5", scene)
        np.testing.assert_array_equal(again.force_n, trace.force_n)

    def test_what_begins_at_an_odd_address_is_told_to_be_copied(self):
        memory = bytearray(17) + np.zeros(64, np.float32).tobytes()
        values = np.frombuffer(memory, np.float32, offset=17).reshape((4, 4, 4), order="F")
        with self.assertRaisesRegex(palpate.ArgumentError, r'values.copy\(order="F"\)'):
            palpate.Voxels(values, AFFINE)
        palpate.Voxels(values.copy(order="F"), AFFINE)


class FirstForce(unittest.TestCase):
    def test_the_program_of_fifteen_lines_is_run_word_for_word(self):
        page = (ROOT / "docs" / "python.md").read_text().partition("## Your arrays")[2]
        program = re.search(r"^```python\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)[1]
        self.assertLessEqual(len(program.splitlines()), 15)
        self.assertIn(f"```python\n{program}```", (ROOT / "README.md").read_text())
        outcome = run_python(program)
        self.assertEqual(outcome.returncode, 0, outcome.stderr)
        self.assertEqual(outcome.stdout, program.splitlines()[-1].rpartition("# ")[2] + "\n")


class Refusals(unittest.TestCase):
    def assert_refused(self, call, *parts):
        with self.assertRaises(palpate.Error) as caught:
            call()
        line = str(caught.exception)
        self.assertNotIn("\n", line)
        self.assertRegex(line, "; ")
        for part in parts:
            self.assertIn(part, line)

    def test_what_an_array_is_not_is_told_with_the_remedy(self):
        good = np.zeros((4, 5, 6), dtype=np.float32, order="F")
        labels = good.astype(np.int32, order="F")
        voxels, make_labels = palpate.Voxels, palpate.Labels
        for call, *parts in (
            (lambda: voxels(good.tolist(), AFFINE), "values: is of type list", "np.asarray"),
            (lambda: voxels(None, AFFINE), "values: is of type NoneType"),
            (lambda: voxels(good.astype(np.int16), AFFINE), "<i2", "astype(np.float32"),
            (lambda: voxels(good.astype(np.float64), AFFINE), "<f8", "astype(np.float32"),
            (lambda: voxels(good.astype(">f4"), AFFINE), ">f4", "astype(np.float32"),
            (lambda: voxels(good.copy(order="C"), AFFINE), "values: ", "np.asfortranarray(values)"),
            (lambda: voxels(good[::2], AFFINE), "values: ", "np.asfortranarray(values)"),
            (lambda: voxels(good[0], AFFINE), "shape (5, 6)", "(I, J, K)"),
            (lambda: voxels(good[:0], AFFINE), "shape (0, 5, 6)", "(I, J, K)"),
            (lambda: voxels(np.ma.masked_equal(good, 1), AFFINE), "masked", "filled"),
            (lambda: voxels(good, AFFINE[:3]), "index_to_scene: ", "(4, 4)"),
            (lambda: voxels(good, "here"), "index_to_scene: ", "(4, 4)"),
            (lambda: voxels(good, AFFINE * np.nan), "index_to_scene: ", "not finite"),
            (lambda: voxels(good, 2 * AFFINE), "index_to_scene: ", "last row"),
            (lambda: voxels(good, np.diag([1, 0, 1, 1])), "index_to_scene is singular"),
            (lambda: voxels(good, np.diag([20, 20, 20, 1])), "mm"),
            (lambda: make_labels(good, AFFINE), "values: is of type <f4", "np.int32"),
            (lambda: make_labels(labels, AFFINE, {1.5: "a"}), "names: key 1.5 is", "[-2147483648"),
            (lambda: make_labels(labels, AFFINE, {np.nan: "a"}), "names: key nan is", "whole"),
            (lambda: make_labels(labels, AFFINE, {np.inf: "a"}), "names: key inf is", "[-2147"),
            (lambda: make_labels(labels, AFFINE, {2**40: "a"}), f"names: key {2**40} is"),
            (lambda: make_labels(labels, AFFINE, {-(2.0**40): "a"}), "names: key -1099511627776.0"),
            (lambda: make_labels(labels, AFFINE, {"1": "a"}), "names: key '1' is", "whole number"),
            (lambda: make_labels(labels, AFFINE, {1: ""}), "names: key 1 has the name ''", "Liver"),
            (lambda: make_labels([labels] * 2, AFFINE, [{}, {0.5: "a"}]), "names[1]: key 0.5 is"),
            (lambda: make_labels([labels] * 2, AFFINE, 7), "names: ", "2 layers"),
            (lambda: make_labels(labels, AFFINE, ["a"]), "names = ['a']"),
            (lambda: make_labels([labels, labels], AFFINE, {1: "a"}), "names: ", "2 layers"),
            (lambda: make_labels([labels, labels[:2].copy("F")], AFFINE), "several shapes"),
            (lambda: make_labels([labels, good], AFFINE), "values[1]: is of type <f4"),
            (lambda: make_labels([], AFFINE), "0 layers"),
            (lambda: palpate.Vectors(good, AFFINE), "shape (4, 5, 6)", "(3, I, J, K)"),
            (
                lambda: palpate.Vectors(np.zeros((4, 4, 4, 3), np.float32, "F"), AFFINE),
                "shape (4, 4, 4, 3)",
                "moveaxis",
            ),
        ):
            with self.subTest(parts[0]):
                self.assert_refused(call, *parts)

    def test_what_a_scene_does_not_make_of_data_is_told(self):
        voxels, labels = ball(), halves()
        mesh = octahedron(0.02)

        def felt(mesh):
            return palpate.Scene(
                {
                    "surface": {"gem": {"mesh": mesh}},
                    "effect": [{"type": "surface", "surface": "gem"}],
                }
            )

        for call, *parts in (
            (lambda: palpate.Scene(scene_of(voxels)), "iso_value"),
            (lambda: palpate.Scene(scene_of(voxels, iso_value=99.0)), "iso_value 99"),
            (lambda: palpate.Scene(scene_of(voxels, label="a")), "skin"),
            (lambda: palpate.Scene(scene_of(labels, iso_value=0.5)), "label"),
            (lambda: palpate.Scene(scene_of(labels, label="liver")), "liver", "left half"),
            (lambda: palpate.Scene({"volume": voxels}), "volume"),
            (lambda: palpate.Scene(scene_of({"file": voxels})), "volume.scan.file", "Voxels"),
            (
                lambda: palpate.Scene(scene_of({"file": voxels.values})),
                "volume.scan.file is of type ndarray; give ",
                "palpate.Voxels(",
                "as volume.scan",
            ),
            (
                lambda: palpate.Scene(scene_of(voxels.values)),
                "volume.scan is of type ndarray; give ",
                "palpate.Voxels(array, index_to_scene), Labels or Vectors",
            ),
            (lambda: felt(tuple(mesh)), "surface.gem.mesh is of type tuple; give", "palpate.Mesh("),
            (lambda: felt(mesh.vertices_m), "surface.gem.mesh is of type ndarray", "palpate.Mesh("),
            (lambda: felt(mesh._asdict()), "surface.gem.mesh is of type dict", "palpate.Mesh("),
            (lambda: felt(mesh._replace(vertices_m=mesh.vertices_m.tolist())), "gem", "vertices_m"),
            (
                lambda: felt(mesh._replace(triangles=mesh.triangles.astype(np.int64))),
                "triangles.astype(np.uint32)",
            ),
            (
                lambda: felt(mesh._replace(vertices_m=np.asfortranarray(mesh.vertices_m))),
                "np.ascontiguousarray(vertices_m)",
            ),
            (lambda: felt(mesh._replace(vertices_m=mesh.vertices_m * np.nan)), "not finite"),
            (lambda: felt(mesh._replace(triangles=mesh.triangles + np.uint32(9))), "vertex"),
            (lambda: felt(mesh._replace(triangles=mesh.triangles[:0])), "empty"),
        ):
            with self.subTest(parts[0]):
                self.assert_refused(call, *parts)

    def test_a_distance_is_of_a_surface_and_of_points(self):
        scene = palpate.Scene(scene_of(ball(), iso_value=0.0), extraction=False)
        self.assert_refused(lambda: palpate.SurfaceDistance(scene, "bone"), "bone", "skin")
        distance = palpate.SurfaceDistance(scene, "skin")
        for points in ([0, 0, 0], [[0, 0]], "abc", [["a", "b", "c"]]):
            self.assert_refused(lambda p=points: distance.nearest(p), "points", "(N, 3)")


if __name__ == "__main__":
    main()
