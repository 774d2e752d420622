# SPDX-License-Identifier: Apache-2.0
"""Reads tracks and answers, and says what is wrong with them: file, line, value, what to do."""

import math

import numpy as np

from program import BadInput, read_text

PATH_COLUMNS = "t_s,x_m,y_m,z_m"
ANSWER_COLUMNS = "t_s,proxy_x_m,proxy_y_m,proxy_z_m,force_x_n,force_y_n,force_z_n,ns,reference_ns"
LENGTHS = {  # in mm and above 0, that shape.txt has for each shape
    "mesh": [],
    "profile": ["half_length_mm"],
    "sphere_cavity": ["radius_mm"],
    "bumpy_cavity": ["radius_mm", "amplitude_mm", "wavelength_mm"],
}
ANEW = "write the track anew with tracks.py"


def number(cell, where):
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise BadInput(f'{where} = "{cell.strip()}" is no finite number; write one, such as 0.001')
    return value


def read_rows(file, columns):
    """The numbers of a CSV file with this header, (rows, columns); at least a row."""
    lines = read_text(file).splitlines()
    if not lines or lines[0].strip() != columns:
        first = lines[0] if lines else ""
        raise BadInput(f'{file}:1: the header is "{first[:120]}"; write exactly "{columns}"')
    if len(lines) == 1:
        raise BadInput(f"{file}:1: no row follows the header; write a row for each frame")
    names = columns.split(",")
    rows = np.empty((len(lines) - 1, len(names)))
    for at, line in enumerate(lines[1:], start=2):
        cells = line.split(",")
        if len(cells) != len(names):
            raise BadInput(f"{file}:{at}: {len(cells)} values; write {len(names)}: {columns}")
        for column, (name, cell) in enumerate(zip(names, cells)):
            rows[at - 2, column] = number(cell, f"{file}:{at}: {name}")
    return rows


def read_path(folder):
    """Times (n,) and probes (n, 3) of a track, m."""
    file = folder / "path.csv"
    rows = read_rows(file, PATH_COLUMNS)
    times = rows[:, 0]
    before = np.concatenate([[np.inf], times[:-1]])
    wrong = np.flatnonzero((times != 0) & ~(times > before))
    if len(wrong):
        raise BadInput(f"{file}:{wrong[0] + 2}: t_s = {times[wrong[0]]:g} is neither 0 nor later "
                       f"than the one before; {ANEW}")  # fmt: skip
    return times, rows[:, 1:]


def read_shape(folder):
    """What shape.txt says: "shape", "stiffness_n_per_m", and lengths in m by their names without
    _mm. "free_space" is "convex" or "any"."""
    file, lines = folder / "shape.txt", {}
    for at, line in enumerate(read_text(file).splitlines(), start=1):
        word, _, value = line.partition(" ")
        if word in lines:
            raise BadInput(f'{file}:{at}: "{word}" is there twice; {ANEW}')
        lines[word] = at, value

    def text(word):
        if word not in lines:
            raise BadInput(f"{file}: has no {word}; {ANEW}")
        return lines[word]

    def above_0(word):
        at, value = text(word)
        if number(value, f"{file}:{at}: {word}") <= 0:
            raise BadInput(f"{file}:{at}: {word} = {value} is not above 0; {ANEW}")
        return float(value)

    at, name = text("shape")
    if name not in LENGTHS:
        raise BadInput(f'{file}:{at}: shape "{name}" is none of {", ".join(LENGTHS)}; {ANEW}')
    shape = {"shape": name, "stiffness_n_per_m": above_0("stiffness_n_per_m")}
    shape["free_space"] = lines.get("free_space", (0, "any"))[1]
    shape |= {word.removesuffix("_mm"): above_0(word) / 1000 for word in LENGTHS[name]}
    if name == "profile":
        shape |= _profile(file, text("profile_mm"), text("bottom_mm"))
    return shape


def _profile(file, top, bottom):
    at, value = top
    numbers = [number(v, f"{file}:{at}: profile_mm") / 1000 for v in value.split()]
    x, z = numbers[::2], numbers[1::2]
    if len(x) < 2 or len(x) != len(z) or any(b <= a for a, b in zip(x, x[1:])):
        raise BadInput(f'{file}:{at}: profile_mm "{value[:80]}" is not x and z of two or more '
                       f"points, x rising; {ANEW}")  # fmt: skip
    at, value = bottom
    bottom_m = number(value, f"{file}:{at}: bottom_mm") / 1000
    if bottom_m >= min(z):
        raise BadInput(f"{file}:{at}: bottom_mm = {value} is not below the profile; {ANEW}")
    return {"profile": list(zip(x, z)), "bottom": bottom_m}


def read_mesh(file):
    """Vertices in m and triangles of an OBJ file in mm as tracks.py writes it."""
    rows, at, above = {"v": [], "f": []}, {"v": [], "f": []}, []
    for line_number, line in enumerate(read_text(file).splitlines(), start=1):
        words = line.split()
        if not words or words[0][0] == "#":
            continue
        if words[0] not in rows or len(words) != 4:
            raise BadInput(f'{file}:{line_number}: "{line[:80]}" is neither v nor f with 3 numbers; '
                           f"{ANEW}")  # fmt: skip
        rows[words[0]].append(words[1:])
        at[words[0]].append(line_number)
        if words[0] == "f":
            above.append(len(rows["v"]))
    if not all(rows.values()):
        raise BadInput(f"{file}: has no vertices or no triangles; {ANEW}")

    def check(kind, is_right, why):
        wrong = np.flatnonzero(~is_right)
        if len(wrong):
            value = " ".join([kind, *rows[kind][wrong[0]]])
            raise BadInput(f'{file}:{at[kind][wrong[0]]}: "{value}" {why}; {ANEW}')

    numbers = {kind: _numbers(rows[kind]) for kind in rows}
    for kind, of_kind in numbers.items():
        check(kind, np.isfinite(of_kind).all(axis=1), "is not 3 finite numbers")
    corners = numbers["f"]
    is_vertex = (corners >= 1) & (corners <= np.array(above)[:, None]) & (corners % 1 == 0)
    check("f", is_vertex.all(axis=1), "has a corner that is none of the vertices above it")
    vertices, triangles = numbers["v"] / 1000, corners.astype(int) - 1
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    check("f", (np.cross(b - a, c - a) != 0).any(axis=1), "is a triangle without an area")
    return vertices, triangles


def _numbers(rows):
    """NaN where a word is no number."""
    try:
        return np.array(rows, float)
    except ValueError:
        return np.array([[_or_nan(word) for word in row] for row in rows])


def _or_nan(word):
    try:
        return float(word)
    except ValueError:
        return math.nan


class TrackFiles:
    """A track's folder: its shape, its path and, where it has one, its mesh."""

    def __init__(self, folder):
        self.folder = folder
        self.shape = read_shape(folder)
        self.times, self.probes = read_path(folder)
        self.begins = self.times == 0
        has_mesh = self.shape["shape"] in ("mesh", "profile")
        self.mesh = read_mesh(folder / "mesh.obj") if has_mesh else None


class Answer:
    """An entrant's rows to a track."""

    def __init__(self, file, times):
        rows = read_rows(file, ANSWER_COLUMNS)
        if len(rows) != len(times):
            raise BadInput(f"{file}: {len(rows)} rows, but the path has {len(times)}; write one "
                           "row for each row of path.csv, in its order")  # fmt: skip
        for at, (own, given) in enumerate(zip(rows[:, 0], times), start=2):
            if abs(own - given) > 1e-6:
                raise BadInput(f"{file}:{at}: t_s = {own:g}, but the path has {given:g}; "
                               "write the rows in the order of path.csv")  # fmt: skip
        for column, name, least in ((7, "ns", 0), (8, "reference_ns", 1)):
            wrong = np.flatnonzero(rows[:, column] < least)
            if len(wrong):
                value = rows[wrong[0], column]
                raise BadInput(f"{file}:{wrong[0] + 2}: {name} = {value:g} is below {least}; "
                               "write the measured time in ns")  # fmt: skip
        self.proxies, self.forces = rows[:, 1:4], rows[:, 4:7]
        self.ns, self.reference_ns = rows[:, 7], rows[:, 8]
