# SPDX-License-Identifier: Apache-2.0
"""The nearest point of a triangle mesh, by brute force over blocks of near triangles.

Blocks are visited in the order of how near their boxes are, until no box is nearer than what was
found: the result is that of looking at every triangle (tests/bench/open/test_truth.py).
"""

import numpy as np

_BLOCK = 64  # triangles
_AT_ONCE = 512  # points, so that a table of points and blocks stays small


class MeshDistance:
    def __init__(self, vertices, triangles):
        corners = vertices[triangles]
        order = _along_a_curve(corners.mean(axis=1))
        fill = -len(order) % _BLOCK  # the last one is repeated
        order = np.concatenate([order, np.repeat(order[-1:], fill)]).reshape(-1, _BLOCK)
        self.corners = corners[order]  # (blocks, _BLOCK, 3 corners, 3)
        self.low, self.high = self.corners.min(axis=(1, 2)), self.corners.max(axis=(1, 2))
        self.normals = _normals(vertices, triangles)[order]

    def nearest(self, points):
        """Nearest points (n, 3) and signed distances (n,), > 0 in front of the triangles."""
        parts = [self._nearest(points[i : i + _AT_ONCE]) for i in range(0, len(points), _AT_ONCE)]
        return tuple(np.concatenate(p) for p in zip(*parts))

    def _nearest(self, points):
        gap = np.zeros((len(points), len(self.low)))
        for axis in range(3):
            p = points[:, None, axis]
            gap += np.maximum(np.maximum(self.low[:, axis] - p, p - self.high[:, axis]), 0) ** 2
        best, found = np.full(len(points), np.inf), np.zeros((len(points), 3))
        normal = np.zeros((len(points), 3))
        active = np.arange(len(points))
        while len(active):
            block = gap[active].argmin(axis=1)
            feature, q = nearest_on(points[active, None], self.corners[block])
            distance = ((points[active, None] - q) ** 2).sum(axis=2)
            i, which = np.arange(len(active)), distance.argmin(axis=1)
            nearer = distance[i, which] < best[active]
            at = active[nearer]
            chosen = (i[nearer], which[nearer])
            best[at], found[at] = distance[chosen], q[chosen]
            normal[at] = self.normals[block[chosen[0]], chosen[1], feature[chosen]]
            gap[active, block] = np.inf
            active = active[gap[active].min(axis=1) < best[active]]
        side = ((points - found) * normal).sum(axis=1)
        return found, np.copysign(np.sqrt(best), side)


def nearest_on(points, corners):
    """Nearest points of triangles, and on what they are: 0 face, 1 to 3 the edge from corner 0, 1,
    2 to the next, 4 to 6 corner 0, 1, 2. Points (..., 3), corners (..., 3 corners, 3)."""
    a = corners[..., 0, :]
    ab, ac = corners[..., 1, :] - a, corners[..., 2, :] - a
    n = np.cross(ab, ac)
    p = points - a
    n2 = (n * n).sum(axis=-1)
    v = (np.cross(p, ac) * n).sum(axis=-1) / n2
    w = (np.cross(ab, p) * n).sum(axis=-1) / n2
    best = a + v[..., None] * ab + w[..., None] * ac
    feature = np.zeros(best.shape[:-1], int)
    outside = (v < 0) | (w < 0) | (v + w > 1)
    least = np.where(outside, np.inf, -1.0)
    for edge in range(3):
        start = corners[..., edge, :]
        way = corners[..., (edge + 1) % 3, :] - start
        s = ((points - start) * way).sum(axis=-1) / (way * way).sum(axis=-1)
        on = start + np.clip(s, 0, 1)[..., None] * way
        distance = ((points - on) ** 2).sum(axis=-1)
        nearer = distance < least
        least = np.where(nearer, distance, least)
        best = np.where(nearer[..., None], on, best)
        is_at = np.where(s <= 0, 4 + edge, np.where(s >= 1, 4 + (edge + 1) % 3, 1 + edge))
        feature = np.where(nearer, is_at, feature)
    return feature, best


def _normals(vertices, triangles):
    """Of each triangle's face, edges and corners (F, 7, 3): sums over what meets there, at corners
    weighted by the angles; their signs are right (Baerentzen and Aanaes 2005)."""
    corners = vertices[triangles]
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    face /= np.linalg.norm(face, axis=1)[:, None]
    ends = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2)
    _, edge = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
    edge = edge.reshape(-1, 3)
    of_edge = _sums(edge, np.repeat(face[:, None], 3, axis=1))
    ways = np.roll(corners, -1, axis=1) - corners
    ways /= np.linalg.norm(ways, axis=2)[..., None]
    angle = np.arccos(np.clip(-(ways * np.roll(ways, 1, axis=1)).sum(axis=2), -1, 1))
    of_corner = _sums(triangles, angle[..., None] * face[:, None])
    return np.concatenate([face[:, None], of_edge[edge], of_corner[triangles]], axis=1)


def _sums(index, values):
    total = [np.bincount(index.ravel(), values[..., axis].ravel()) for axis in range(3)]
    return np.stack(total, axis=1)


def _along_a_curve(points):
    """An order in which near points are near (Morton)."""
    low, high = points.min(axis=0), points.max(axis=0)
    cell = ((points - low) / np.maximum(high - low, 1e-12) * 1023).astype(np.int64)
    key = np.zeros(len(points), np.int64)
    for bit in range(10):
        for axis in range(3):
            key |= ((cell[:, axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(key, kind="stable")
