# SPDX-License-Identifier: Apache-2.0
"""What is right on a track: how far a point is from the surface, and where the proxy belongs.

All lengths in m. A signed distance is > 0 in free space. The right proxy is where the descent of
the distance to the probe ends that begins at the last right proxy and never enters the material:
the god object of Zilles and Salisbury (1995), exactly.
"""

import numpy as np

from closest import MeshDistance
from files import TrackFiles
from program import BadInput, end_as_part


class Cavity:
    """The inside of a ball; the nearest point of free space is unique."""

    def __init__(self, radius_m):
        self.radius_m = radius_m

    def signed_distance(self, points):
        return self.radius_m - np.linalg.norm(points, axis=1)

    def proxies(self, probes, _):
        length = np.linalg.norm(probes, axis=1)
        return probes * np.minimum(1, self.radius_m / np.maximum(length, 1e-12))[:, None]


class BumpyCavity:
    """|x| < radius + amplitude s(u), u = x / |x|, s = the product of sin(w u_i) over x, y and z,
    w = 2 pi radius / wavelength. No probe is deeper than the surface's radii of curvature."""

    FAR_M = 3e-3  # from here on a distance is taken along the ray from the middle
    ROUNDS = 80

    def __init__(self, radius_m, amplitude_m, wavelength_m):
        self.radius_m, self.amplitude_m = radius_m, amplitude_m
        self.w = 2 * np.pi * radius_m / wavelength_m

    def _surface(self, points):
        """The surface's point on each ray from the middle."""
        u = points / np.maximum(np.linalg.norm(points, axis=1), 1e-12)[:, None]
        return u * (self.radius_m + self.amplitude_m * np.sin(self.w * u).prod(axis=1))[:, None]

    def _normal(self, x):
        """Of |x| - radius - amplitude s(x / |x|): unit, out of free space."""
        r = np.linalg.norm(x, axis=1)[:, None]
        u = x / r
        sines, cosines = np.sin(self.w * u), np.cos(self.w * u)
        slope = self.w * cosines * np.roll(sines, 1, axis=1) * np.roll(sines, 2, axis=1)
        slope -= u * (u * slope).sum(axis=1)[:, None]
        g = u - self.amplitude_m * slope / r
        return g / np.linalg.norm(g, axis=1)[:, None]

    def _nearest(self, points):
        """By turns onto the tangent plane and back along the ray: a contraction by the depth over
        the radius of curvature."""
        x = self._surface(points)
        for _ in range(self.ROUNDS):
            n = self._normal(x)
            x = self._surface(points - n * (n * (points - x)).sum(axis=1)[:, None])
        return x

    def signed_distance(self, points):
        along = np.linalg.norm(self._surface(points), axis=1) - np.linalg.norm(points, axis=1)
        near = np.abs(along) < self.FAR_M
        distance = np.linalg.norm(points[near] - self._nearest(points[near]), axis=1)
        along[near] = np.copysign(distance, along[near])
        return along

    def proxies(self, probes, _):
        behind = self.signed_distance(probes) < 0
        result = probes.copy()
        result[behind] = self._nearest(probes[behind])
        return result


class Prism:
    """A body along y over a polygon of x and z: the proxy walks around the polygon."""

    def __init__(self, profile_m, bottom_m):
        left, right = profile_m[0], profile_m[-1]
        # Clockwise as x to the right and z up: free space is to the left of each edge.
        self.corners = np.array([*profile_m, (right[0], bottom_m), (left[0], bottom_m)])
        self.to_next = np.roll(self.corners, -1, axis=0) - self.corners
        self.lengths = np.linalg.norm(self.to_next, axis=1)
        self.t = self.to_next / self.lengths[:, None]
        self.n = np.stack([-self.t[:, 1], self.t[:, 0]], axis=1)

    def signed_distance(self, points):
        p = points[:, None, [0, 2]] - self.corners
        s = np.clip((p * self.t).sum(axis=2), 0, self.lengths)
        distance = np.linalg.norm(p - s[..., None] * self.t, axis=2).min(axis=1)
        z0, dz, dx = self.corners[:, 1], self.to_next[:, 1], self.to_next[:, 0]
        z = points[:, None, 2]
        crosses = (z0 <= z) != (z0 + dz <= z)
        x = self.corners[:, 0] + dx * (z - z0) / np.where(dz == 0, 1, dz)
        inside = (crosses & (x > points[:, None, 0])).sum(axis=1) % 2 == 1
        return np.where(inside, -distance, distance)

    def proxies(self, probes, begins):
        result = probes.copy()
        spot = None
        for i, probe in enumerate(probes[:, [0, 2]]):
            if begins[i]:
                proxy, spot = probe, None
            proxy, spot = self._descend(proxy, spot, probe)
            result[i, 0], result[i, 2] = proxy
        return result

    def _descend(self, at, spot, probe):
        """From a point to where the way to the probe ends. `spot`: None in free space, (edge, None)
        on an edge, (edge, edge) at the corner between two."""
        for _ in range(4 * len(self.corners)):
            if spot is None:
                at, spot = self._fly(at, (), probe)
                if spot is None:
                    return at, None
            way = probe - at
            edges = spot if spot[1] is not None else spot[:1]
            if self._is_free(spot, way):
                at, next_spot = self._fly(at, edges, probe)
                if next_spot is None:
                    return at, None
                spot = next_spot
                continue
            going = [(way @ self.t[e] * sign, e, sign) for e, sign in self._ways(spot)]
            along, edge, sign = max(going)
            if along <= 1e-15:
                return at, spot
            at, spot = self._slide(at, edge, sign, along)
        raise BadInput("the descent to a proxy does not end: profile_mm crosses itself; write the "
                       "track anew with tracks.py")  # fmt: skip

    def _ways(self, spot):
        """Along an edge both ways; from a corner back on the edge before and on to the next."""
        before, after = spot if spot[1] is not None else (spot[0], spot[0])
        return (before, -1), (after, 1)

    def _is_free(self, spot, way):
        height = self.n[spot[0]] @ way
        if spot[1] is None:
            return height > 1e-15
        other = self.n[spot[1]] @ way
        before, after = self.t[spot[0]], self.t[spot[1]]
        turns_down = before[0] * after[1] - before[1] * after[0] < 0  # a ridge
        return max(height, other) > 1e-15 if turns_down else min(height, other) > 1e-15

    def _slide(self, at, edge, sign, along):
        s = (at - self.corners[edge]) @ self.t[edge] + sign * along
        if 0 < s < self.lengths[edge]:
            return self.corners[edge] + s * self.t[edge], (edge, None)
        corner = edge if s <= 0 else (edge + 1) % len(self.corners)
        return self.corners[corner], ((corner - 1) % len(self.corners), corner)

    def _fly(self, at, leaves, probe):
        """Straight to the probe, or to the first edge that is met from its front."""
        way = probe - at
        falling = self.n @ way
        with np.errstate(divide="ignore", invalid="ignore"):
            share = ((self.corners - at) * self.n).sum(axis=1) / falling
            s = ((at + share[:, None] * way - self.corners) * self.t).sum(axis=1)
        met = (falling < 0) & (share >= -1e-12) & (share < 1) & (s >= 0) & (s <= self.lengths)
        met[list(leaves)] = False
        if not met.any():
            return probe, None
        edge = int(np.argmin(np.where(met, share, np.inf)))
        return self.corners[edge] + s[edge] * self.t[edge], (edge, None)


class Mesh:
    """The nearest point of a mesh. It is the right proxy only where free space is convex."""

    def __init__(self, mesh, free_space_is_convex):
        self.distance = MeshDistance(*mesh)
        self.free_space_is_convex = free_space_is_convex

    def signed_distance(self, points):
        return self.distance.nearest(points)[1]

    def proxies(self, probes, _):
        if not self.free_space_is_convex:
            return None
        nearest, signed = self.distance.nearest(probes)
        return np.where((signed < 0)[:, None], nearest, probes)


def truth_of(track):
    """Of the files of a track, or of its folder."""
    files = track if isinstance(track, TrackFiles) else TrackFiles(track)
    shape = files.shape
    if shape["shape"] == "sphere_cavity":
        return Cavity(shape["radius"])
    if shape["shape"] == "bumpy_cavity":
        return BumpyCavity(shape["radius"], shape["amplitude"], shape["wavelength"])
    if shape["shape"] == "profile":
        return Prism(shape["profile"], shape["bottom"])
    return Mesh(files.mesh, shape["free_space"] == "convex")


end_as_part(__name__, "score.py")
