#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes a label volume to find lumps in by touch: a soft organ with three balls in it.

    scripts/make_lump_phantom.py demo-output/data/lumps.seg.nrrd

The organ is an ellipsoid with half axes of 60, 45 and 30 mm, in voxels of 1 mm. Each ball has a
label of its own; LUMPS says where it is. examples/find_the_lump.toml feels it.
"""
import math
import os
import sys

HALF_AXES_MM = (60.0, 45.0, 30.0)
# Name, place of the point of the surface above it (x, y in mm), depth of its top along the normal
# there, and radius, in mm.
LUMPS = [
    ("Shallow", -25.0, 8.0, 2.0, 5.0),
    ("Deep", 22.0, 10.0, 5.0, 5.0),
    ("Small", 4.0, -18.0, 5.0, 2.5),
]
COLORS = ["0.86 0.55 0.45", "0.95 0.85 0.3", "0.4 0.7 0.9", "0.5 0.85 0.5"]


def centre_of(lump):
    """Where a ball's centre is: down the normal of the ellipsoid."""
    _, x, y, top, radius = lump
    a, b, c = HALF_AXES_MM
    z = c * math.sqrt(1 - (x / a) ** 2 - (y / b) ** 2)
    normal = (x / a**2, y / b**2, z / c**2)
    length = math.sqrt(sum(n * n for n in normal))
    return tuple(p - (top + radius) * n / length for p, n in zip((x, y, z), normal))


def voxels():
    """Values, x fastest, and how many there are along each axis; the first centre, in mm."""
    margin = 4
    half = [int(h) + margin for h in HALF_AXES_MM]
    centres = [centre_of(lump) for lump in LUMPS]
    values = bytearray()
    for z in range(-half[2], half[2] + 1):
        for y in range(-half[1], half[1] + 1):
            for x in range(-half[0], half[0] + 1):
                inside = sum((p / h) ** 2 for p, h in zip((x, y, z), HALF_AXES_MM)) <= 1
                value = 1 if inside else 0
                for i, (lump, centre) in enumerate(zip(LUMPS, centres)):
                    if inside and math.dist((x, y, z), centre) <= lump[4]:
                        value = 2 + i
                values.append(value)
    sizes = [2 * half[0] + 1, 2 * half[1] + 1, 2 * half[2] + 1]
    return bytes(values), sizes, tuple(-h for h in half)


def header(sizes, first):
    lines = ["NRRD0004", "type: uint8", "dimension: 3", "space: left-posterior-superior",
             "sizes: " + " ".join(map(str, sizes)),
             "space directions: (1,0,0) (0,1,0) (0,0,1)", "kinds: domain domain domain",
             "encoding: raw", "space origin: (" + ",".join(map(str, first)) + ")"]
    for i, name in enumerate(["Organ"] + [lump[0] for lump in LUMPS]):
        lines += [f"Segment{i}_ID:={name}", f"Segment{i}_Name:={name}", f"Segment{i}_Color:={COLORS[i]}",
                  f"Segment{i}_LabelValue:={i + 1}", f"Segment{i}_Layer:=0"]
    return ("\n".join(lines) + "\n\n").encode()


def main():
    if len(sys.argv) != 2 or not sys.argv[1].endswith(".seg.nrrd"):
        sys.exit("usage: make_lump_phantom.py FILE.seg.nrrd")
    values, sizes, first = voxels()
    part = sys.argv[1] + ".part"
    try:
        os.makedirs(os.path.dirname(part) or ".", exist_ok=True)
        with open(part, "wb") as file:
            file.write(header(sizes, first) + values)
        os.replace(part, sys.argv[1])
    except OSError as error:
        if os.path.isfile(part):
            os.remove(part)
        sys.exit(f"make_lump_phantom.py: {sys.argv[1]}: {error.strerror}; name another file")


if __name__ == "__main__":
    main()
