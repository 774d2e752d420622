# SPDX-License-Identifier: Apache-2.0
"""What is right on a track, against slower ways to find it."""

import numpy as np
import support
from support import WithTracks

from closest import MeshDistance, nearest_on
from files import read_mesh
from truth import truth_of


class Truth(WithTracks):
    TRACKS = ["sphere", "bumps", "sphere_20k", "plate", "wedge", "grooves"]

    def test_the_nearest_point_of_a_mesh_is_that_of_all_triangles(self):
        vertices, triangles = read_mesh(self.tracks / "grooves" / "mesh.obj")
        points = np.random.default_rng(1).uniform(-0.05, 0.05, (60, 3))
        nearest, signed = MeshDistance(vertices, triangles).nearest(points)
        every = nearest_on(points[:, None], vertices[triangles][None])[1]
        distance = np.linalg.norm(every - points[:, None], axis=2).min(axis=1)
        self.assertLess(np.abs(distance - np.abs(signed)).max(), 1e-16)
        self.assertLess(np.abs(np.linalg.norm(nearest - points, axis=1) - distance).max(), 1e-16)

    def test_a_prism_is_as_far_as_its_mesh(self):
        # Off the mesh's ends, where the prism goes on; its corners are rounded to 1e-9 m.
        points = np.random.default_rng(2).uniform(-0.04, 0.04, (500, 3))
        for track in ("plate", "wedge", "grooves"):
            mesh = MeshDistance(*read_mesh(self.tracks / track / "mesh.obj"))
            signed = truth_of(self.tracks / track).signed_distance(points)
            inner = np.abs(signed) < 0.05 - np.abs(points[:, 1])
            self.assertGreater(inner.sum(), 100)
            off = np.abs(mesh.nearest(points)[1] - signed)[inner]
            self.assertLess(off.max(), 2e-9, track)

    def test_a_proxy_rests_nowhere_but_nearest_in_its_surroundings(self):
        directions = np.random.default_rng(3).normal(size=(64, 3))
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        step = 1e-6
        for track in self.TRACKS:
            truth = truth_of(self.tracks / track)
            _, probes, begins = self.path(track)
            proxies = truth.proxies(probes, begins)
            self.assertLess((-truth.signed_distance(proxies)).max(), 1e-12, track)
            some = np.flatnonzero(np.linalg.norm(proxies - probes, axis=1) > 1e-5)[::19]
            at, near = proxies[some], np.linalg.norm(proxies - probes, axis=1)[some]
            for direction in directions:
                moved = at + step * direction
                is_free = truth.signed_distance(moved) >= 0
                distance = np.linalg.norm(moved - probes[some], axis=1)
                self.assertTrue((distance >= near - 1e-13)[is_free].all(), track)

    def test_a_proxy_gets_no_farther_from_the_probe_than_if_it_stayed(self):
        for track in ("plate", "wedge", "grooves"):
            _, probes, begins = self.path(track)
            proxies = truth_of(self.tracks / track).proxies(probes, begins)
            stayed = np.linalg.norm(proxies[:-1] - probes[1:], axis=1)
            went = np.linalg.norm(proxies[1:] - probes[1:], axis=1)
            self.assertTrue((went <= stayed + 1e-15)[~begins[1:]].all(), track)

    def test_no_probe_is_straight_below_an_edge(self):
        # There rounding would decide on which side the proxy goes: seen as proxies 3 mm apart.
        for track in ("plate", "wedge", "grooves"):
            _, probes, _ = self.path(track)
            corners = truth_of(self.tracks / track).corners[:, 0]
            self.assertGreater(np.abs(probes[:, :1] - corners).min(), 1e-8, track)

    def test_a_bump_is_as_far_as_the_nearest_of_many_of_its_points(self):
        truth = truth_of(self.tracks / "bumps")
        _, probes, _ = self.path("bumps")
        near = probes[np.abs(truth.signed_distance(probes)) < 1.9e-3][::97]
        around = np.stack(np.meshgrid(*3 * [np.linspace(-4e-3, 4e-3, 41)]), -1).reshape(-1, 3)
        for point in near:
            samples = truth._surface(point + around)
            least = np.linalg.norm(samples - point, axis=1).min()
            exact = abs(truth.signed_distance(point[None])[0])
            self.assertLessEqual(exact, least + 1e-15)
            # Samples are 0.2 mm apart: one is within 0.15 mm of the nearest point across the way.
            self.assertLess(least, np.hypot(exact, 0.15e-3) + 0.02e-3)

    def test_a_mesh_of_a_ball_lies_between_two_balls(self):
        vertices, _ = read_mesh(self.tracks / "sphere_20k" / "mesh.obj")
        radius = np.linalg.norm(vertices, axis=1).max()
        truth = truth_of(self.tracks / "sphere_20k")
        _, probes, begins = self.path("sphere_20k")
        proxies = truth.proxies(probes, begins)
        held = np.linalg.norm(proxies - probes, axis=1) > 0
        off = radius - np.linalg.norm(proxies, axis=1)[held]
        # Edges are at most 2.2 mm long: a facet is at most its circumradius squared / 2 R inside.
        self.assertGreater(off.min(), -2e-9)
        self.assertLess(off.max(), (2.2e-3 / np.sqrt(3)) ** 2 / (2 * radius) * 1.1)


if __name__ == "__main__":
    support.main()
