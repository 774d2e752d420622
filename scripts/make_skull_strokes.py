#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Strokes over the places of the head CT where mesh and volume are most likely to disagree: the face, the teeth, and the
thinnest bone, found from the wall thickness of the field.

usage: make_skull_strokes.py skull.raw OUT     (numpy; skull.raw of scripts/fetch_data.sh)

Writes OUT/skull_face.csv, skull_teeth.csv and skull_thin.csv: probe paths of 0.2 m/s, a row per ms, as `palpate trace
--device path:FILE` reads them. The ones in tests/data/paths were made by it."""
import sys

import numpy as np

SIZE = (108, 256, 256)  # k, j, i
SPACING = np.array([0.9570312, -0.9570312, 1.5])  # mm, of i, j, k; scene frame LPS
ORIGIN = np.array([-122.021478, 122.021478, -80.25])
LEVEL = 248.8  # HU, of bone after smoothing by 0.7 voxels
STEP = 0.2  # mm per frame: 0.2 m/s


def smoothed(volume, sigma=0.7):
    weights = np.exp(-0.5 * (np.arange(-4, 5) / sigma) ** 2)
    weights /= weights.sum()
    for axis in range(3):
        padded = np.pad(volume, [(4, 4) if a == axis else (0, 0) for a in range(3)], mode="edge")
        volume = sum(w * np.take(padded, np.arange(n, n + volume.shape[axis]), axis=axis) for n, w in enumerate(weights))
    return volume


class Field:
    def __init__(self, file):
        self.values = smoothed(np.fromfile(file, "<i2").reshape(SIZE).astype(np.float64))

    def value(self, points):
        """Trilinear, HU; points in mm, LPS. Outside it is air."""
        index = (np.atleast_2d(points) - ORIGIN) / SPACING
        cell = np.floor(index).astype(int)
        share = index - cell
        inside = np.all((cell >= 0) & (cell < np.array(SIZE[::-1]) - 1), axis=1)
        cell = np.where(inside[:, None], cell, 0)
        result = np.zeros(len(index))
        for corner in range(8):
            at = np.array([corner & 1, corner >> 1 & 1, corner >> 2])
            weight = np.prod(np.where(at, share, 1 - share), axis=1)
            i, j, k = (cell + at).T
            result += weight * self.values[k, j, i]
        return np.where(inside, result, -1000.0)

    def gradient(self, point):
        h = 0.7
        offsets = h * np.concatenate([np.eye(3), -np.eye(3)])
        values = self.value(point + offsets)
        return (values[:3] - values[3:]) / (2 * h)


def walked(corners):
    """A polyline at constant speed, a row per frame."""
    rows = [corners[0]]
    for a, b in zip(corners, corners[1:]):
        frames = max(1, int(np.ceil(np.linalg.norm(b - a) / STEP)))
        rows += [a + (b - a) * n / frames for n in range(1, frames + 1)]
    return rows


def write(file, strokes):
    with open(file, "w", encoding="ascii") as out:
        out.write("t_s,x_m,y_m,z_m\n")
        for stroke in strokes:
            for n, p in enumerate(walked(stroke)):
                out.write("%.3f,%.6f,%.6f,%.6f\n" % (1e-3 * n, *(1e-3 * p)))


def front_strokes(field, xs, zs, depth, fastest):
    """Along x over what is met from the front, `depth` mm into it; the depth changes by `fastest` mm per mm at most."""
    strokes = []
    ys = np.arange(-121.0, 40.0, 0.25)
    for row, z in enumerate(zs):
        front = []
        for x in xs:
            values = field.value(np.column_stack([np.full_like(ys, x), ys, np.full_like(ys, z)]))
            solid = np.nonzero(values >= LEVEL)[0]
            front.append(ys[solid[0]] if len(solid) else np.inf)
        front = np.array(front)
        if not np.isfinite(front).any():
            continue
        y = front + depth
        for n in range(1, len(y)):  # towards the hand, so that nothing becomes deeper
            y[n] = min(y[n], y[n - 1] + fastest * (xs[n] - xs[n - 1]))
        for n in range(len(y) - 2, -1, -1):
            y[n] = min(y[n], y[n + 1] + fastest * (xs[n + 1] - xs[n]))
        corners = [np.array([x, b, z]) for x, b in zip(xs, y)]
        if row % 2:
            corners.reverse()
        air = np.min(front) - 5.0
        first, last = corners[0].copy(), corners[-1].copy()
        first[1] = last[1] = air
        strokes.append([first] + corners + [last])
    return strokes


def thin_strokes(field, count, apart):
    """Into the thinnest walls from in front of them, through and beyond, 4 mm along them, and out again."""
    solid = field.values >= LEVEL
    edge = solid & ~(np.roll(solid, 1, 0) & np.roll(solid, -1, 0) & np.roll(solid, 1, 1) & np.roll(solid, -1, 1)
                     & np.roll(solid, 1, 2) & np.roll(solid, -1, 2))
    along = np.arange(-9.0, 9.0, 0.1)  # mm before and behind the wall
    found = []
    for k, j, i in np.argwhere(edge)[::7]:
        point = ORIGIN + SPACING * np.array([i, j, k])
        if not (abs(point[0]) < 70 and -115 < point[1] < 100 and -70 < point[2] < 70):
            continue
        slope = field.gradient(point)
        length = np.linalg.norm(slope)
        if length < 50.0:
            continue
        inwards = slope / length
        wall = field.value(point + np.outer(along, inwards)) >= LEVEL
        enters = np.nonzero(wall)[0]
        if len(enters) == 0 or enters[0] == 0:
            continue
        thickness = 0.1 * len(enters)
        if thickness > 2.0 or np.any(np.diff(enters) > 1) or along[enters[0]] > 2.0 or along[enters[-1]] > 4.0:
            continue
        found.append((thickness, point + along[enters[0]] * inwards, inwards))
    found.sort(key=lambda entry: entry[0])
    strokes, places = [], []
    for thickness, point, inwards in found:
        if len(strokes) == count:
            break
        if any(np.linalg.norm(point - other) < apart for other in places):
            continue
        places.append(point)
        sideways = np.cross(inwards, [0.0, 0.0, 1.0] if abs(inwards[2]) < 0.9 else [1.0, 0.0, 0.0])
        sideways /= np.linalg.norm(sideways)
        start = point - 7.0 * inwards
        deep = point + 4.0 * inwards
        strokes.append([start, deep, deep + 4.0 * sideways, deep - 4.0 * sideways, start])
    print("thinnest walls: %d of %d candidates, %.1f to %.1f mm" % (len(strokes), len(found), found[0][0],
          max(t for t, p, _ in found if any(p is q for q in places))))
    return strokes


def main():
    field, out = Field(sys.argv[1]), sys.argv[2]
    write(out + "/skull_face.csv", front_strokes(field, np.arange(-55.0, 55.1, 0.5), np.arange(-60.0, 21.0, 5.0), 3.0, 1.5))
    write(out + "/skull_teeth.csv", front_strokes(field, np.arange(-28.0, 28.1, 0.25), np.arange(-77.0, -61.0, 1.0), 4.0, 2.0))
    write(out + "/skull_thin.csv", thin_strokes(field, 60, 8.0))


if __name__ == "__main__":
    main()
