# SPDX-License-Identifier: Apache-2.0
"""Meshes of the tracks, by exact arithmetic. Vertices (V, 3) in mm; triangles (F, 3), counter-
clockwise as seen from free space."""

import numpy as np

from exact import unit


def cavity(radius_mm, levels, axes):
    """The inside of a ball: an icosahedron whose triangles are cut into four, `levels` times."""
    golden = (1.0 + np.sqrt(5.0)) / 2.0
    corners = [(s, t * golden, 0.0) for s in (-1.0, 1.0) for t in (-1.0, 1.0)]
    corners = np.array([np.roll(c, shift) for shift in range(3) for c in corners])
    triangles = _icosahedron_triangles(corners)
    points = unit(corners)
    for _ in range(levels):
        points, triangles = _cut_into_four(points, triangles)
    turned = points[:, :1] * axes[0] + points[:, 1:2] * axes[1] + points[:, 2:] * axes[2]
    return radius_mm * unit(turned), triangles[:, ::-1]  # seen from inside


def _icosahedron_triangles(corners):
    """Its 20 triangles: three corners at the distance 2, counter-clockwise from outside."""
    found = []
    for i in range(12):
        for j in range(i + 1, 12):
            for k in range(j + 1, 12):
                a, b, c = corners[i], corners[j], corners[k]
                if max(np.abs(d @ d - 4.0) for d in (a - b, b - c, c - a)) < 1e-9:
                    outward = np.cross(b - a, c - a) @ a > 0
                    found.append((i, j, k) if outward else (i, k, j))
    return np.array(found)


def _cut_into_four(points, triangles):
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    edges, which = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    middles = unit(points[edges[:, 0]] + points[edges[:, 1]])
    ab, bc, ca = which.reshape(3, -1) + len(points)
    a, b, c = triangles.T
    cut = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.concatenate([points, middles]), np.concatenate([np.stack(t, axis=1) for t in cut])


def prism(profile_mm, bottom_mm, half_length_mm, facet_mm):
    """A body along y: `profile_mm` (n, 2) is its top from left to right as x, z; flat below."""
    x, z = _refined(profile_mm, facet_mm)
    y = np.linspace(-half_length_mm, half_length_mm, int(2 * half_length_mm / facet_mm) + 1)
    n, m = len(x), len(y)
    top = np.stack([np.repeat(x, m), np.tile(y, n), np.repeat(z, m)], axis=1)
    below = top.copy()
    below[:, 2] = bottom_mm
    index = np.arange(n * m).reshape(n, m)
    low = index + n * m
    sides = [
        _quads(index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]),
        _quads(low[:-1, :-1], low[:-1, 1:], low[1:, 1:], low[1:, :-1]),
        _quads(low[0, 1:], low[0, :-1], index[0, :-1], index[0, 1:]),  # x smallest
        _quads(low[-1, :-1], low[-1, 1:], index[-1, 1:], index[-1, :-1]),  # x greatest
        _quads(low[:-1, 0], low[1:, 0], index[1:, 0], index[:-1, 0]),  # y smallest
        _quads(low[1:, -1], low[:-1, -1], index[:-1, -1], index[1:, -1]),  # y greatest
    ]
    return np.concatenate([top, below]), np.concatenate(sides)


def _refined(profile_mm, facet_mm):
    x, z = [profile_mm[0][0]], [profile_mm[0][1]]
    for (x0, z0), (x1, z1) in zip(profile_mm[:-1], profile_mm[1:]):
        pieces = max(1, int(np.ceil((x1 - x0) / facet_mm)))
        for i in range(1, pieces + 1):
            x.append(x1 if i == pieces else x0 + (x1 - x0) * i / pieces)
            z.append(z1 if i == pieces else z0 + (z1 - z0) * i / pieces)
    return np.array(x), np.array(z)


def _quads(a, b, c, d):
    a, b, c, d = (np.asarray(v).ravel() for v in (a, b, c, d))
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


_CORNERS = np.array([[i, j, k] for k in (0, 1) for j in (0, 1) for i in (0, 1)])
# A cube as six tetrahedra around its diagonal; neighbours fit, as each cuts a face alike.
_TETRAHEDRA = [(0, 1, 3, 7), (0, 3, 2, 7), (0, 2, 6, 7), (0, 6, 4, 7), (0, 4, 5, 7), (0, 5, 1, 7)]
# Where the corners whose bits are set are inside: the triangles, by the edges that are cut.
_CUTS = {
    1: [(0, 1), (0, 2), (0, 3)], 2: [(1, 0), (1, 3), (1, 2)],
    4: [(2, 0), (2, 1), (2, 3)], 8: [(3, 0), (3, 2), (3, 1)],
    3: [(0, 2), (0, 3), (1, 3), (1, 2)], 5: [(0, 1), (2, 1), (2, 3), (0, 3)],
    9: [(0, 1), (0, 2), (3, 2), (3, 1)],
}  # fmt: skip


def level_of(values, level):
    """Where voxels (I, J, K) reach a level, by marching tetrahedra, in indices; inside where they
    are greater. Closed, as the outermost voxels are below the level. No value is the level."""
    if (values == level).any():
        raise ValueError("a voxel has the value of the level: choose another level")
    size = values.shape
    flat = values.ravel()
    cells = np.stack(np.meshgrid(*(np.arange(s - 1) for s in size), indexing="ij"), -1)
    corner = [np.ravel_multi_index((cells + c).reshape(-1, 3).T, size) for c in _CORNERS]
    inside = [flat[c] > level for c in corner]
    mixed = np.logical_or.reduce(inside) & ~np.logical_and.reduce(inside)
    corner = [c[mixed] for c in corner]
    tetrahedra = ([corner[t] for t in tetra] for tetra in _TETRAHEDRA)
    ends = [piece for tetra in tetrahedra for piece in _cut(flat, level, tetra)]
    keys, triangles = np.unique(np.concatenate(ends).reshape(-1, 2), axis=0, return_inverse=True)
    low, high = flat[keys[:, 0]].astype(float), flat[keys[:, 1]].astype(float)
    start, end = (np.stack(np.unravel_index(k, size), 1).astype(float) for k in keys.T)
    return start + ((level - low) / (high - low))[:, None] * (end - start), triangles.reshape(-1, 3)


def _cut(flat, level, tetra):
    """Triangles (n, 3, 2) of a tetrahedron of each cell, their corners as the ends of edges."""
    case = sum((flat[t] > level).astype(int) << i for i, t in enumerate(tetra))
    for bits, cut in _CUTS.items():
        for inverted in (False, True):
            which = case == ((15 - bits) if inverted else bits)
            if not which.any():
                continue
            corners = [np.sort(np.stack([tetra[a][which], tetra[b][which]], 1), 1) for a, b in cut]
            for triangle in [(0, 1, 2), (0, 2, 3)][: len(cut) - 2]:
                order = triangle[::-1] if inverted else triangle
                yield np.stack([corners[i] for i in order], axis=1)
