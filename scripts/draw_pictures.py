#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Draws the pictures of docs/numerics.md, docs/composition.md and docs/mesh_contact.md that need no
library: curves and steps are computed here, from the formulas beside them.

usage: draw_pictures.py FOLDER     (usually docs/pictures)

Writes drift.svg, energy.svg, level_plane.svg, play.svg, frame.svg, friction.svg and edges.svg."""
import math
import pathlib
import sys

# Words in each of the first five have 4.5 : 1 on white and on SOLID (WCAG 2.1, 1.4.3). What is told
# apart by colour is told apart by dashes or by words beside it too.
INK, GREY, RED, BLUE, EDGE, SOLID = "#333", "#666", "#b02a1e", "#245a9c", "#6a5a38", "#efe6d5"
WIDTH = 420  # of every picture: its text of 13 px is 11 px high on a phone of 390 px


class Picture:
    """An SVG in pixels, with y downwards."""

    def __init__(self, height):
        shown = 1.3  # where a page has room
        self.parts = [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" '
            f'width="{shown * WIDTH:.0f}" height="{shown * height:.0f}" '
            'font-family="sans-serif" font-size="13">',
            '<rect width="100%" height="100%" fill="#fff"/>',
        ]

    def line(self, points, color=INK, width=1.5, dash="", fill="none"):
        text = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        dashed = f' stroke-dasharray="{dash}"' if dash else ""
        self.parts.append(
            f'<polyline points="{text}" fill="{fill}" stroke="{color}" '
            f'stroke-width="{width}"{dashed} stroke-linejoin="round"/>'
        )

    def area(self, points, fill=SOLID):
        text = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        self.parts.append(f'<polygon points="{text}" fill="{fill}"/>')

    def dot(self, at, color=INK, radius=4):
        self.parts.append(
            f'<circle cx="{at[0]:.1f}" cy="{at[1]:.1f}" r="{radius}" fill="{color}"/>'
        )

    def text(self, at, words, color=INK, anchor="start"):
        words = words.replace("&", "&amp;").replace("<", "&lt;")
        self.parts.append(
            f'<text x="{at[0]:.1f}" y="{at[1]:.1f}" fill="{color}" '
            f'text-anchor="{anchor}">{words}</text>'
        )

    def arrow(self, start, end, color=INK, width=1.5, dash=""):
        self.line([start, end], color, width, dash)
        angle = math.atan2(end[1] - start[1], end[0] - start[0])
        tips = [
            (end[0] - 9 * math.cos(angle + turn), end[1] - 9 * math.sin(angle + turn))
            for turn in (0.4, -0.4)
        ]
        self.area([end] + tips, color)

    def box(self, left, top, width, height, words, fill="#f6f6f6"):
        self.parts.append(
            f'<rect x="{left}" y="{top}" width="{width}" height="{height}" rx="6" '
            f'fill="{fill}" stroke="{GREY}"/>'
        )
        first = top + height / 2 + 5 - 8 * (len(words) - 1)
        for i, line in enumerate(words):
            self.text((left + width / 2, first + 16 * i), line, anchor="middle")

    def axes(self, origin, right, top, x_words, y_words):
        self.arrow(origin, (right, origin[1]), GREY, 1)
        self.arrow(origin, (origin[0], top), GREY, 1)
        self.text((right - 4, origin[1] + 18), x_words, GREY, "end")
        self.text((origin[0] + 8, top + 8), y_words, GREY)

    def write(self, folder, name):
        (folder / name).write_text("\n".join(self.parts + ["</svg>", ""]), encoding="utf-8")


def drift(folder):
    """Steps along tangents of a circle: 4 and 16 of them over the same angle of the probe."""
    picture = Picture(230)
    center, radius = (210.0, 270.0), 215.0

    def at(r, angle):
        return center[0] + r * math.sin(angle), center[1] - r * math.cos(angle)

    angles = [-0.8 + 1.6 * i / 200 for i in range(201)]
    wall = [at(radius, a) for a in angles]
    picture.area([(0, 0), (WIDTH, 0), (WIDTH, 120), *reversed(wall), (0, 120)])
    picture.line(wall, EDGE, 2)
    for steps, color, radius_px, height in ((4, RED, 4, 202), (16, BLUE, 2.5, 222)):
        angle, r = -0.62, radius
        corners = [at(r, angle)]
        for _ in range(steps):
            length = 1.24 * radius / steps  # the hand's way
            angle, r = angle + math.atan(length / r), math.hypot(r, length)
            corners.append(at(r, angle))
        picture.line(corners, color, 1.8)
        for corner in corners:
            picture.dot(corner, color, radius_px)
        off = 100 * (r / radius - 1)
        picture.dot((126, height - 5), color, radius_px)
        picture.text((138, height), f"{steps} steps: {off:.1f} % of R off", color)
    picture.text((210, 158), "each step is right at its beginning,", anchor="middle")
    picture.text((210, 176), "and ends outside by h²/2R", anchor="middle")
    picture.text((12, 20), "inside the material")
    picture.text((210, 76), "wall", EDGE, "middle")
    picture.write(folder, "drift.svg")


def energy(folder):
    """The energy on a line through a wall at 0: one that holds, and one that yields."""
    picture = Picture(590)
    k, probe = 500.0, -2.0  # N/m, mm
    for top, strength, words in ((0, 1.6, "strong wall, s = 1.6 N: holds"),
                                 (295, 0.5, "weak wall, s = 0.5 N: yields")):
        def x(mm):
            return 20 + 82 * (mm + 3.2)

        def y(mj, top=top):
            return top + 240 - 68 * mj

        def spring(mm):
            return 0.5 * k * (mm - probe) ** 2 * 1e-3  # mJ

        def wall(mm, strength=strength):
            return strength * max(0.0, -mm)  # N mm = mJ

        picture.area([(x(-3.2), y(0)), (x(0), y(0)), (x(0), y(3)), (x(-3.2), y(3))])
        grid = [-3.2 + 4.7 * i / 200 for i in range(201)]
        for law, color, width, dash in ((spring, GREY, 1.5, "7 4"), (wall, EDGE, 1.5, "2 3"),
                                        (lambda mm: spring(mm) + wall(mm), RED, 2.2, "")):
            picture.line([(x(mm), y(law(mm))) for mm in grid if law(mm) < 3.0], color, width, dash)
        best = min(0.0, probe + 1e3 * strength / k)
        picture.line([(x(-3.2), y(0)), (x(1.5), y(0))], GREY, 1)
        picture.dot((x(probe), y(0)), INK)
        picture.text((x(probe), y(0) + 19), "probe a", anchor="middle")
        picture.dot((x(best), y(spring(best) + wall(best))), RED, 5)
        picture.line([(x(best), y(spring(best) + wall(best))), (x(best), y(0))], RED, 1, "3 3")
        picture.text((x(best), y(0) + 36), "proxy x'", RED, "middle")
        picture.text((20, top + 22), words)
        picture.text((x(0.6), y(spring(0.75)) - 8), "energy E", RED, "end")
        at = -2.85 if strength > 1 else -3.1
        picture.text((x(at), y(0.3 if strength > 1 else 0.5)), "spring", GREY)
        picture.text((x(-1.0 if strength > 1 else -2.45),
                      y(wall(-0.75)) if strength > 1 else y(wall(-2.3)) + 22), "wall", EDGE, "end")
    picture.write(folder, "energy.svg")


def level_plane(folder):
    """One evaluation near a level: the plane through the proxy, and the one through the level."""
    picture = Picture(280)
    center, radius = (210.0, 385.0), 265.0

    def at(r, angle):
        return center[0] + r * math.sin(angle), center[1] - r * math.cos(angle)

    wall = [at(radius, -0.8 + 1.6 * i / 100) for i in range(101)]
    picture.area([(0, 0), (WIDTH, 0), (WIDTH, wall[-1][1]), *reversed(wall), (0, wall[0][1])])
    picture.line(wall, EDGE, 2)
    proxy, probe = at(radius + 30, -0.35), at(radius + 95, 0.12)
    for r, color, dash in ((radius + 30, GREY, "5 4"), (radius, BLUE, "")):
        foot = at(r, -0.35)
        along = (math.cos(-0.35), math.sin(-0.35))
        picture.line([(foot[0] - 70 * along[0], foot[1] - 70 * along[1]),
                      (foot[0] + 205 * along[0], foot[1] + 205 * along[1])], color, 1.4, dash)
        way = (probe[0] - foot[0]) * along[0] + (probe[1] - foot[1]) * along[1]
        end = (foot[0] + way * along[0], foot[1] + way * along[1])
        picture.arrow(proxy, end, RED if color == BLUE else GREY, 2.0 if color == BLUE else 1.2)
        picture.dot(end, RED if color == BLUE else GREY)
    foot = at(radius, -0.35)
    picture.line([proxy, foot], INK, 1, "2 3")
    picture.dot(proxy)
    picture.dot(probe)
    picture.text((proxy[0] - 10, proxy[1] - 6), "x", anchor="end")
    picture.text((probe[0] + 9, probe[1] + 5), "probe a")
    picture.text((foot[0] - 10, foot[1] + 20), "p", BLUE, "end")
    picture.text((14, 246), "dashed: the plane through the proxy keeps the error", GREY)
    picture.text((14, 268), "solid: the plane through the level takes it back", BLUE)
    picture.text((408, 150), "level c", EDGE, "end")
    picture.write(folder, "level_plane.svg")


def play(folder):
    """Force over depth: of a surface that holds when it yields, and of one that opens."""
    picture = Picture(590)
    k, strength = 0.5, 2.0  # N/mm, N
    way = [(0.0, 6.5), (6.5, 3.2), (3.2, 8.0), (8.0, 0.0)]  # mm
    depths = [a + (b - a) * i / 200 for a, b in way for i in range(201)]

    def holds(depths):
        level = 0.0
        for depth in depths:
            level = max(0.0, min(max(level, depth - strength / k), depth))
            yield depth, k * max(0.0, depth - level)

    def opens(depths):
        is_open = False
        for depth in depths:
            is_open = (is_open or k * depth >= strength) and depth > 0.0
            yield depth, 0.0 if is_open else k * depth

    for top, law, words in ((0, holds, 'yield = "holds": play'),
                            (275, opens, 'yield = "opens": a membrane')):
        def place(point, top=top):
            return 30 + 39 * point[0], top + 232 - 78 * point[1]

        picture.axes(place((0, 0)), 405, top + 42, "depth of the probe", "force")
        picture.line([place((0, 2)), place((8.8, 2))], GREY, 1, "4 4")
        picture.text(place((9.0, 1.95)), "s", GREY)
        picture.text((place((4, 0))[0], top + 250), "s/k", GREY, "middle")
        picture.line([place(point) for point in law(depths)], RED, 2)
        picture.text((20, top + 22), words)
    for start, end in (((1.5, 0.75), (2.5, 1.25)), ((4.6, 2.0), (5.6, 2.0)),
                       ((5.7, 1.6), (4.7, 1.1)), ((7.4, 1.7), (6.4, 1.2))):
        picture.arrow((30 + 39 * start[0], 232 - 78 * start[1]),
                      (30 + 39 * end[0], 232 - 78 * end[1]), RED)
    picture.text((20, 558), "500 N/m, strength 2 N:")
    picture.text((20, 577), "pressed to 6.5 mm, back to 3.2, to 8, and out")
    picture.write(folder, "play.svg")


def frame(folder):
    """The loop of one frame."""
    picture = Picture(420)
    boxes = [["begin", "anchor at x0"], ["gather", "primitives (6)"], ["solve", "balance (7)"],
             ["step", "share (9) or curvature"], ["carry", "as far as certified"]]
    left, wide, high, apart = 20, 170, 50, 72
    for i, words in enumerate(boxes):
        picture.box(left, 15 + apart * i, wide, high, words)
    for i in range(len(boxes) - 1):
        picture.arrow((left + wide / 2, 15 + apart * i + high), (left + wide / 2, 15 + apart * (i + 1)))
    picture.line([(left + wide, 316), (226, 316), (226, 112)])
    picture.arrow((226, 112), (left + wide, 112))
    for i, words in enumerate(("until converged,", "at the cap,", "or out of time (8)")):
        picture.text((236, 236 + 18 * i), words)
    picture.box(250, 350, 150, high, ["commit", "levels move"], "#f3e3e0")
    picture.line([(left + wide / 2, 353), (left + wide / 2, 375)])
    picture.arrow((left + wide / 2, 375), (250, 375))
    picture.text((236, 96), "surfaces and effects", EDGE)
    picture.text((236, 114), "know geometry", EDGE)
    picture.text((236, 178), "the solver knows", BLUE)
    picture.text((236, 196), "forces only", BLUE)
    picture.text((236, 310), "surfaces know", EDGE)
    picture.text((236, 328), "no forces", EDGE)
    picture.write(folder, "frame.svg")


def friction(folder):
    """A hand that drags the proxy over a plane: the proxy lags by mu lambda / k."""
    picture = Picture(520)
    for top, x0, probe_x, words, color in (
            (0, 130, 165, "holds: the proxy keeps its bits", BLUE),
            (260, 130, 290, "slips: it follows, and lags", RED)):
        wall = top + 100
        picture.area([(0, wall), (WIDTH, wall), (WIDTH, top + 240), (0, top + 240)])
        picture.line([(0, wall), (WIDTH, wall)], EDGE, 2)
        picture.text((408, wall - 8), "surface", EDGE, "end")
        reach, depth = 55.0, 110.0  # mu lambda / k and lambda / k, pixels
        end = x0 if probe_x - x0 <= reach else probe_x - reach
        probe = (probe_x, wall + depth)
        picture.line([(probe_x - reach, wall), probe, (probe_x + reach, wall)], GREY, 1, "4 3")
        picture.line([(end, wall), probe], color, 2)
        picture.dot(probe)
        picture.dot((end, wall), color, 5)
        if end != x0:
            picture.arrow((x0, wall - 20), (end, wall - 20), color)
            picture.dot((x0, wall), GREY, 3)
            picture.text((x0, wall - 28), "x0", GREY, "middle")
            picture.line([(end, wall + 22), (probe_x, wall + 22)], color, 1)
            picture.text((end - 8, wall + 27), "mu lambda / k", color, "end")
        else:
            picture.text((x0, wall - 12), "x0 = x'", color, "middle")
        picture.text((probe[0] + 10, probe[1] + 5), "probe")
        picture.text((20, top + 26), words, color)
    picture.text((20, 516), "dashed: where the proxy may rest under this probe")
    picture.write(folder, "friction.svg")


def edges(folder):
    """The nearest feature to a pull at an edge, in a cut across it: a ridge and a valley."""
    picture = Picture(560)
    for top, rise, words in ((130, 1, "ridge"), (440, -1, "valley")):
        edge, slope = (210, top), 0.4 * rise
        bottom = 280 if rise > 0 else 540
        ends = [(20, top + 190 * slope), (400, top + 190 * slope)]
        picture.area([ends[0], edge, ends[1], (400, bottom), (20, bottom)])
        picture.line([ends[0], edge, ends[1]], EDGE, 2)
        size = math.hypot(1, slope)
        for sign in (-1, 1):  # the facets' normals at the edge
            normal = (sign * slope / size, -1 / size)
            picture.arrow(edge, (edge[0] + 46 * normal[0], edge[1] + 46 * normal[1]), GREY, 1)
        picture.dot(edge, INK, 4)
        picture.text((40, bottom - 12), words)
        pulls = (((120, 95), "into the right facet", RED, (0, 22)),
                 ((0, -64), "lifts off", BLUE, (10, 5)))
        if rise < 0:
            pulls = (((0, 46), "rests in the valley", RED, (10, 8)),
                     ((120, -25), "into the right facet", BLUE, (10, 32)))
        for (dx, dy), what, color, off in pulls:
            pull = (edge[0] + dx, edge[1] + dy)
            picture.dot(pull, color, 4)
            picture.line([edge, pull], color, 1, "3 3")
            picture.text((pull[0] + off[0], pull[1] + off[1]), what, color,
                         "start" if dx == 0 else "middle")
            if "facet" in what:
                along = (1 / size, slope / size)
                way = dx * along[0] + dy * along[1]
                foot = (edge[0] + way * along[0], edge[1] + way * along[1])
                picture.arrow(edge, foot, color, 2)
                picture.line([pull, foot], color, 1, "2 3")
    picture.text((20, 22), "thin arrows: normals; dots: where a pull may be;")
    picture.text((20, 41), "thick arrows: the way it takes")
    picture.write(folder, "edges.svg")


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    for draw in (drift, energy, level_plane, play, frame, friction, edges):
        draw(folder)


if __name__ == "__main__":
    main()
