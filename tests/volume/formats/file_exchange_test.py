#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Reads the files of FOLDER/truth.txt as other programs do and compares where things lie.

    file_exchange_test.py FOLDER
truth.txt: lines "volume NAME m00 m01 m02 m03 m10 ... m23" (index -> mm, LPS; voxel number n in i-fastest order has the
value n) and "mesh NAME ..." (the map of a tetrahedron's corners). NIfTI is read by nibabel, NRRD and PLY here, by their
text. Exit status: 0 all agree, 1 something does not, 77 nibabel is missing and the rest agrees.
"""
import os
import re
import struct
import sys
import zlib

FLOAT = 2.0**-24  # half a unit in the last place of 1
SIZE = (7, 5, 4)


def apply(m, p):
    return [sum(m[r][c] * p[c] for c in range(3)) + m[r][3] for r in range(3)]


def corners():
    return [(i, j, k) for i in (0, SIZE[0] - 1) for j in (0, SIZE[1] - 1) for k in (0, SIZE[2] - 1)]


def compare_maps(name, found, truth, tolerance):
    for corner in corners():
        a, b = apply(found, corner), apply(truth, corner)
        error = max(abs(x - y) for x, y in zip(a, b))
        if not error <= tolerance:
            return ["%s: voxel %s lies at %s, not %s" % (name, corner, a, b)]
    return []


def float_tolerance(truth):
    """Rounding of twelve header numbers to float, in mm; twice, as a quaternion stands behind some of them."""
    return max(2 * FLOAT * (sum(abs(row[c]) * SIZE[c] for c in range(3)) + abs(row[3])) for row in truth)


def number_of(i, j, k):
    return i + SIZE[0] * (j + SIZE[1] * k)


def check_nifti(folder, name, truth, nibabel):
    image = nibabel.load(os.path.join(folder, name))
    affine = image.affine  # index -> RAS
    lps = [[sign * affine[r][c] for c in range(4)] for r, sign in enumerate((-1, -1, 1))]
    problems = compare_maps(name, lps, truth, float_tolerance(truth))
    data = image.get_fdata()
    if tuple(data.shape) != SIZE:
        return problems + ["%s: has size %s" % (name, data.shape)]
    wrong = [c for c in corners() if data[c] != number_of(*c)]
    return problems + ["%s: voxel %s has another value" % (name, c) for c in wrong]


def check_nrrd(folder, name, truth):
    with open(os.path.join(folder, name), "rb") as stream:
        header, data = stream.read().split(b"\n\n", 1)
    fields = dict(re.findall(r"^([a-z ]+): (.*?)\r?$", header.decode("ascii"), re.M))
    if fields["space"] != "left-posterior-superior" or fields["type"] != "float" or fields["endian"] != "little":
        return ["%s: has another space, type or byte order" % name]
    columns = [[float(x) for x in v.split(",")] for v in re.findall(r"\(([^)]*)\)", fields["space directions"])]
    origin = [float(x) for x in fields["space origin"].strip("()").split(",")]
    lps = [[columns[c][r] for c in range(3)] + [origin[r]] for r in range(3)]
    problems = compare_maps(name, lps, truth, 1e-9)  # mm: fifteen digits and more of 100 mm
    if fields["encoding"] == "gzip":
        data = zlib.decompress(data, 31)
    if tuple(int(x) for x in fields["sizes"].split()) != SIZE or len(data) != 4 * SIZE[0] * SIZE[1] * SIZE[2]:
        return problems + ["%s: has another size" % name]
    values = struct.unpack("<%df" % (len(data) // 4), data)
    wrong = [c for c in corners() if values[number_of(*c)] != number_of(*c)]
    return problems + ["%s: voxel %s has another value" % (name, c) for c in wrong]


def check_mesh(folder, name, truth):
    with open(os.path.join(folder, name), "rb") as stream:
        header, data = stream.read().split(b"end_header\n", 1)
    lines = header.decode("ascii").splitlines()
    for line in ("format binary_little_endian 1.0", "comment SPACE=LPS", "comment UNIT=mm", "element vertex 4",
                 "element face 4", "property double x"):
        if line not in lines:
            return ["%s: does not say '%s'" % (name, line)]
    problems = []
    for n, corner in enumerate(((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))):
        found, expected = struct.unpack_from("<3d", data, 24 * n), apply(truth, corner)
        if max(abs(a - b) for a, b in zip(found, expected)) > 1e-9:
            problems.append("%s: vertex %d lies at %s, not %s" % (name, n, found, expected))
    return problems


def main(folder):
    try:
        import nibabel
    except ImportError:
        nibabel = None
    problems, checked = [], 0
    with open(os.path.join(folder, "truth.txt")) as stream:
        for line in stream:
            kind, name, *numbers = line.split()
            truth = [[float(x) for x in numbers[4 * r:4 * r + 4]] for r in range(3)]
            if kind == "mesh":
                problems += check_mesh(folder, name, truth)
            elif name.endswith(".nrrd"):
                problems += check_nrrd(folder, name, truth)
            elif nibabel is not None:
                problems += check_nifti(folder, name, truth, nibabel)
            else:
                continue
            checked += 1
    if problems:
        print("\n".join(problems[:20]))
        return 1
    if nibabel is None:
        print("nibabel is missing (Debian: python3-nibabel); %d other files agree" % checked)
        return 77
    print("%d files agree" % checked)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
