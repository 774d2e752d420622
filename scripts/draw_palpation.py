#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Draws the pictures of docs/palpation.md, from the formulas beside them.

usage: draw_palpation.py FOLDER     (usually docs/pictures)

Writes fronts.svg, soft_force.svg and lump.svg."""
import math
import pathlib
import sys

from draw_pictures import BLUE, EDGE, GREY, INK, RED, SOLID, WIDTH, Picture

BONE = "#d8cbb0"


def coil(picture, start, end, color, turns=6, half_px=7):
    """A spring as a zigzag, with straight ends."""
    points = [start]
    along = (end[0] - start[0], end[1] - start[1])
    size = math.hypot(*along)
    across = (-along[1] / size * half_px, along[0] / size * half_px)
    for i in range(2 * turns + 1):
        share = 0.15 + 0.7 * i / (2 * turns)
        side = 0 if i in (0, 2 * turns) else (1 if i % 2 else -1)
        points.append((start[0] + share * along[0] + side * across[0],
                       start[1] + share * along[1] + side * across[1]))
    picture.line(points + [end], color, 1.8)


def fronts(folder):
    """Probe, tip and front: of a soft surface that is alone, and of skin over bone."""
    picture = Picture(560)
    for top, bone, words in ((0, None, "a soft surface"), (280, 120, "skin over bone")):
        wall, probe, bottom = top + 70, top + 235, top + 265
        tip = top + 70 + (bone if bone else 99)
        picture.area([(0, wall), (WIDTH, wall), (WIDTH, bottom), (0, bottom)])
        picture.line([(0, wall), (WIDTH, wall)], EDGE, 2)
        if bone:
            picture.area([(0, wall + bone), (WIDTH, wall + bone), (WIDTH, bottom), (0, bottom)],
                         BONE)
            picture.line([(0, wall + bone), (WIDTH, wall + bone)], EDGE, 2)
            picture.text((408, wall + bone + 20), "bone: hard", EDGE, "end")
        coil(picture, (150, wall), (150, tip), EDGE)
        coil(picture, (150, tip), (150, probe), RED)
        for y, color in ((wall, BLUE), (tip, RED), (probe, INK)):
            picture.dot((150, y), color, 5)
        picture.text((14, top + 24), words)
        picture.text((166, wall - 10), "front y, on the surface", BLUE)
        picture.text((166, (wall + tip) / 2 + 5), "tissue: the surface's law", EDGE)
        picture.text((166, tip + (-8 if bone else 5)), "tip x (the proxy)", RED)
        picture.text((166, probe - (14 if bone else 26)), "coupling k", RED)
        picture.text((166, probe + 5), "probe a (the hand)")
        picture.line([(100, wall), (100, tip)], GREY, 1)
        picture.text((94, (wall + tip) / 2 + 5), "indentation d", GREY, "end")
    picture.write(folder, "fronts.svg")


def soft_force(folder):
    """Force over the depth of the hand, behind a coupling of 0.5 N/mm."""
    k, soft, bone = 0.5, 0.2, 6.0  # N/mm, N/mm, mm beneath the skin
    table = [(0.0, 0.0), (4.0, 0.2), (8.0, 1.0), (12.0, 2.8)]
    picture = Picture(340)

    def place(depth, force):
        return 34 + 24.5 * depth, 290 - 72 * force

    picture.axes(place(0, 0), 410, 30, "", "force, N")
    picture.text((402, 328), "depth of the hand, mm", GREY, "end")
    for mm in (4, 8, 12):
        picture.text((place(mm, 0)[0], 308), str(mm), GREY, "middle")
    for newton in (1, 2, 3):
        picture.text((28, place(0, newton)[1] + 5), str(newton), GREY, "end")
        picture.line([place(0, newton), place(14.5, newton)], "#ddd", 1)

    # The tip is on bone once the tissue has given way that far: d = (1 - K / k) depth.
    on_bone = bone / (1 - soft / k)
    curves = (
        ([(0.0, 0.0), (6.6, 3.3)], GREY, "5 4", "hard", (5.6, 3.1), "end"),
        ([(0.0, 0.0), (14.5, soft * 14.5)], BLUE, "", "0.2 N/mm", (14.5, 2.12), "end"),
        ([(on_bone, soft * on_bone), (12.6, k * (12.6 - bone))], RED, "",
         "with bone 6 mm beneath", (15.1, 3.42), "end"),
        (table + [(13.2, 2.8 + 0.45 * 1.2)], EDGE, "2 3", "a table", (7.2, 0.5), "start"),
    )
    for points, color, dash, words, at, anchor in curves:
        picture.line([place(*point) for point in points], color, 2.2, dash)
        picture.text(place(*at), words, color, anchor)
    picture.write(folder, "soft_force.svg")


def kernel(offset_mm, depth_mm, radius_mm, contact_mm, factor):
    """K / K0 over a ball whose centre is that deep and that far aside."""
    cell = radius_mm / 12
    total = 0.0
    steps = [cell * (i + 0.5) for i in range(-12, 12)]
    for x in steps:
        for y in steps:
            for z in steps:
                if x * x + y * y + z * z > radius_mm**2:
                    continue
                deep = depth_mm + z
                aside2 = (offset_mm + x) ** 2 + y * y
                total += deep**2 / (aside2 + deep**2 + (0.75 * contact_mm) ** 2) ** 3
    return 1 + factor * 6 * contact_mm / math.pi**2 * total * cell**3


def lump(folder):
    """The stiffness over a ball ten times as stiff, 5 mm deep: kernel and finite elements."""
    picture = Picture(470)
    scale = 9.0  # pixels a mm
    middle, surface = 210, 270
    factor = 5 * (10 - 1) / (2 * 10 + 3)

    def place(offset, ratio):
        return middle + scale * offset, 245 - 720 * (ratio - 1)

    picture.axes((20, 245), 410, 24, "mm aside", "stiffness")
    for percent in (10, 20):
        y = place(0, 1 + percent / 100)[1]
        picture.line([(20, y), (400, y)], "#ddd", 1)
        picture.text((26, y - 4), f"+{percent} %", GREY)
    for offset in (-10, 0, 10):
        picture.text((middle + scale * offset, 263), f"{abs(offset)}", GREY, "middle")
    half = [(mm, kernel(mm, 10.0, 5.0, 4.0, factor)) for mm in range(0, 21)]
    curve = [(-mm, ratio) for mm, ratio in reversed(half)] + half[1:]
    picture.line([place(*point) for point in curve], RED, 2.2)
    # Of a slab of 20 mm: scripts/fe_lump.py --beside 0 3 6 9 12
    for offset, ratio in ((0, 1.225), (3, 1.186), (6, 1.108), (9, 1.047), (12, 1.018)):
        for sign in {-1, 1} if offset else {1}:
            picture.dot(place(sign * offset, ratio), BLUE)
    picture.text((400, 60), "dots: finite elements", BLUE, "end")
    picture.text((400, 80), "line: the kernel", RED, "end")
    picture.area([(0, surface + 25), (WIDTH, surface + 25), (WIDTH, 470), (0, 470)])
    picture.line([(0, surface + 25), (WIDTH, surface + 25)], EDGE, 2)
    picture.line([(middle - 4 * scale, surface + 22), (middle + 4 * scale, surface + 22)], INK, 5)
    picture.text((middle + 5 * scale, surface + 19), "contact, radius 4 mm")
    center = (middle, surface + 25 + 10 * scale)
    picture.parts.append(f'<circle cx="{center[0]}" cy="{center[1]}" r="{5 * scale}" '
                         f'fill="{BONE}" stroke="{EDGE}"/>')
    picture.text((middle, center[1] + 5), "10 times", EDGE, "middle")
    picture.line([(middle, surface + 25), (middle, surface + 25 + 5 * scale)], GREY, 1)
    picture.text((middle + 6, surface + 52), "5 mm", GREY)
    picture.text((14, 460), "tissue", EDGE)
    picture.write(folder, "lump.svg")


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    for draw in (fronts, soft_force, lump):
        draw(folder)


if __name__ == "__main__":
    main()
