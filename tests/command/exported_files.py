#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Reads what `palpate export` wrote with nothing of ours, and compares it with frames.csv.

exported_files.py FOLDER: FOLDER has t/frames.csv, run.mrk.json, run.vtp and s.vtp. Exit 1 where
something differs.
"""
import csv
import json
import math
import sys
import xml.etree.ElementTree as xml
from pathlib import Path


def fail(what):
    sys.exit(f"exported_files.py: {what}")


def require(is_right, what):
    if not is_right:
        fail(what)


def near(a, b):
    return all(abs(x - y) <= 1e-9 * max(1.0, abs(y)) for x, y in zip(a, b, strict=True))


def read_vtp(file):
    """Points, lines, triangles and columns of a .vtp, as xml.etree finds them."""
    root = xml.parse(file).getroot()
    require(root.tag == "VTKFile" and root.get("type") == "PolyData", f"{file}: is no PolyData")
    space = root.find("PolyData/FieldData/Array")
    letters = [chr(int(code)) for code in space.text.split() if int(code) != 0]
    require("".join(letters) == "LPS", f"{file}: states no frame")
    piece = root.find("PolyData/Piece")

    def numbers(array):
        width = int(array.get("NumberOfComponents", "1"))
        flat = [float(word) for word in (array.text or "").split()]
        return [flat[n : n + width] for n in range(0, len(flat), width)]

    def cells(section):
        arrays = {array.get("Name"): numbers(array) for array in piece.find(section)}
        corners = [int(one[0]) for one in arrays["connectivity"]]
        ends = [int(one[0]) for one in arrays["offsets"]]
        return [corners[a:b] for a, b in zip([0, *ends], ends)]

    points = numbers(piece.find("Points/DataArray"))
    require(len(points) == int(piece.get("NumberOfPoints")), f"{file}: number of points")
    columns = {array.get("Name"): numbers(array) for array in piece.find("PointData")}
    for name, column in columns.items():
        require(len(column) == len(points), f"{file}: length of {name}")
    lines, triangles = cells("Lines"), cells("Polys")
    require(len(lines) == int(piece.get("NumberOfLines")), f"{file}: number of lines")
    require(len(triangles) == int(piece.get("NumberOfPolys")), f"{file}: number of triangles")
    return points, lines, triangles, columns


def main(folder):
    with open(folder / "t" / "frames.csv", newline="", encoding="utf-8") as file:
        frames = list(csv.DictReader(file))

    def place(row, name):
        return [1e3 * float(row[f"{name}_{axis}_m"]) for axis in "xyz"]

    def force(row):
        return [float(row[f"force_{axis}_n"]) for axis in "xyz"]

    points, lines, triangles, columns = read_vtp(folder / "run.vtp")
    require(len(lines) == 2 and not triangles, "a line of the probe and one of the proxy")
    for line, name in zip(lines, ("probe", "proxy")):
        require(len(line) == len(frames), f"{name}: a point for each frame")
        for n, row in zip(line, frames):
            require(near(points[n], place(row, name)), f"{name} at {row['time_s']} s")
            require(near(columns["time_s"][n], [float(row["time_s"])]), "times")
            require(near(columns["force_n"][n], force(row)), "forces")

    markups = json.loads((folder / "run.mrk.json").read_text(encoding="utf-8"))["markups"]
    by_name = {markup["name"]: markup for markup in markups}
    at_time = {round(float(row["time_s"]), 6): row for row in frames}
    for name in ("probe", "proxy"):
        curve = by_name[name]
        require(curve["type"] == "Curve" and curve["coordinateSystem"] == "LPS", "a curve in LPS")
        measured = {one["name"]: one["controlPointValues"] for one in curve["measurements"]}
        for point, time, newtons in zip(curve["controlPoints"], measured["time"],
                                        measured["force"], strict=True):
            row = at_time[round(time, 6)]
            require(near(point["position"], place(row, name)), f"{name} at {time} s in markups")
            require(near([newtons], [math.hypot(*force(row))]), "force in markups")
    touches = by_name["touches"]
    require(touches["type"] == "Fiducial" and touches["controlPoints"], "touches as points")
    require({point["label"] for point in touches["controlPoints"]} == {"s"}, "touches by surface")

    points, lines, triangles, columns = read_vtp(folder / "s.vtp")
    require(not lines and len(triangles) > 100, "the mesh of a ball")
    radii = [math.dist(point, (0.0, 0.0, 0.0)) for point in points]
    require(19.0 < min(radii) and max(radii) < 21.0, "a ball of 20 mm")
    in_contact = sum(1 for row in frames if row["felt"])
    touched = sum(one[0] for one in columns["touched_s"])
    require(abs(touched - 1e-3 * in_contact) < 1e-9, f"{touched} s touched of {in_contact} frames")
    strongest = max(range(len(points)), key=lambda n: columns["force_n"][n][0])
    require(math.dist(points[strongest], (20.0, 0.0, 0.0)) < 3.0, "touched where it was pressed")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
