#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Draws the pictures of docs/numerics.md, docs/composition.md and docs/mesh_contact.md that need no
library: curves and steps are computed here, from the formulas beside them.

usage: draw_pictures.py FOLDER     (usually docs/pictures)

Writes drift.svg, energy.svg, level_plane.svg, play.svg, frame.svg, friction.svg and edges.svg."""
import math
import pathlib
import sys

INK, GREY, RED, BLUE, SOLID, EDGE = "#333", "#999", "#c0392b", "#2f6db5", "#efe6d5", "#8a7a55"


class Picture:
    """An SVG in pixels, with y downwards."""

    def __init__(self, width, height):
        self.parts = [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
            f'width="{width}" height="{height}" font-family="sans-serif" font-size="13">',
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

    def text(self, at, words, color=INK, anchor="start", size=13):
        words = words.replace("&", "&amp;").replace("<", "&lt;")
        self.parts.append(
            f'<text x="{at[0]:.1f}" y="{at[1]:.1f}" fill="{color}" text-anchor="{anchor}" '
            f'font-size="{size}">{words}</text>'
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
    picture = Picture(640, 330)
    center, radius = (320.0, 440.0), 330.0

    def at(r, angle):
        return center[0] + r * math.sin(angle), center[1] - r * math.cos(angle)

    angles = [-0.8 + 1.6 * i / 200 for i in range(201)]
    wall = [at(radius, a) for a in angles]
    picture.area([(0, 0), (640, 0), (640, 210), *reversed(wall), (0, 210)])
    picture.line(wall, EDGE, 2)
    for steps, color, where in ((4, RED, 40), (16, BLUE, 62)):
        angle, r = -0.62, radius
        corners = [at(r, angle)]
        for _ in range(steps):
            length = 1.24 * radius / steps  # the hand's way
            angle, r = angle + math.atan(length / r), math.hypot(r, length)
            corners.append(at(r, angle))
        picture.line(corners, color, 1.8)
        for corner in corners:
            picture.dot(corner, color, 3)
        off = 100 * (r / radius - 1)
        picture.text((200, 230 + where), f"{steps} steps: {off:.1f} % of R off", color)
    picture.text((200, 250), "each step is right at its beginning, and ends outside by h²/2R")
    picture.text((20, 24), "inside the material")
    picture.text((320, 128), "wall", EDGE, "middle")
    picture.write(folder, "drift.svg")


def energy(folder):
    """The energy on a line through a wall at 0: one that holds, and one that yields."""
    picture = Picture(760, 330)
    k, probe = 500.0, -2.0  # N/m, mm
    for left, strength, words in ((20, 1.6, "strong wall, s = 1.6 N: holds"),
                                  (395, 0.5, "weak wall, s = 0.5 N: yields")):
        def x(mm, left=left):
            return left + 60 + 60 * (mm + 3)

        def y(mj):
            return 255 - 70 * mj

        def spring(mm):
            return 0.5 * k * (mm - probe) ** 2 * 1e-3  # mJ

        def wall(mm, strength=strength):
            return strength * max(0.0, -mm)  # N mm = mJ

        picture.area([(x(-3.2), 255), (x(0), 255), (x(0), 40), (x(-3.2), 40)])
        grid = [-3.2 + 4.7 * i / 200 for i in range(201)]
        for law, color, width in ((spring, GREY, 1.2), (wall, EDGE, 1.2),
                                  (lambda mm: spring(mm) + wall(mm), RED, 2.2)):
            picture.line([(x(mm), y(law(mm))) for mm in grid if law(mm) < 3.0], color, width)
        best = min(0.0, probe + 1e3 * strength / k)
        picture.line([(x(-3.2), 255), (x(1.6), 255)], GREY, 1)
        picture.dot((x(probe), 255), INK)
        picture.text((x(probe), 274), "probe a", anchor="middle")
        picture.dot((x(best), y(spring(best) + wall(best))), RED, 5)
        picture.line([(x(best), y(spring(best) + wall(best))), (x(best), 255)], RED, 1, "3 3")
        picture.text((x(best), 290), "proxy x'", RED, "middle")
        picture.text((left + 20, 24), words)
    words = "red: the energy E; grey: of the spring; brown: of the wall"
    picture.text((380, 318), words, INK, "middle")
    picture.write(folder, "energy.svg")


def level_plane(folder):
    """One evaluation near a level: the plane through the proxy, and the one through the level."""
    picture = Picture(640, 320)
    center, radius = (320.0, 520.0), 400.0

    def at(r, angle):
        return center[0] + r * math.sin(angle), center[1] - r * math.cos(angle)

    wall = [at(radius, -0.75 + 1.5 * i / 100) for i in range(101)]
    picture.area([(0, 0), (640, 0), (640, 225), *reversed(wall), (0, 225)])
    picture.line(wall, EDGE, 2)
    proxy, probe = at(radius + 34, -0.35), at(radius + 106, 0.1)
    for r, color, dash in ((radius + 34, GREY, "5 4"), (radius, BLUE, "")):
        foot = at(r, -0.35)
        along = (math.cos(-0.35), math.sin(-0.35))
        picture.line([(foot[0] - 90 * along[0], foot[1] - 90 * along[1]),
                      (foot[0] + 290 * along[0], foot[1] + 290 * along[1])], color, 1.4, dash)
        way = (probe[0] - foot[0]) * along[0] + (probe[1] - foot[1]) * along[1]
        end = (foot[0] + way * along[0], foot[1] + way * along[1])
        picture.arrow(proxy, end, RED if color == BLUE else GREY, 2.0 if color == BLUE else 1.2)
        picture.dot(end, RED if color == BLUE else GREY)
    foot = at(radius, -0.35)
    picture.line([proxy, foot], INK, 1, "2 3")
    picture.dot(proxy)
    picture.dot(probe)
    picture.text((proxy[0] - 12, proxy[1] - 8), "x", anchor="end")
    picture.text((probe[0] + 8, probe[1]), "probe a")
    picture.text((foot[0] - 14, foot[1] + 22), "p", BLUE, "end")
    picture.text((120, 282), "grey: the plane through the proxy keeps the error")
    picture.text((120, 302), "blue: the plane through the level takes it back", BLUE)
    picture.text((570, 150), "level c", EDGE)
    picture.write(folder, "level_plane.svg")


def play(folder):
    """Force over depth: of a surface that holds when it yields, and of one that opens."""
    picture = Picture(760, 320)
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

    for left, law, words in ((20, holds, 'yield = "holds": play'),
                             (395, opens, 'yield = "opens": a membrane')):
        def place(point, left=left):
            return left + 40 + 33 * point[0], 260 - 80 * point[1]

        picture.axes(place((0, 0)), left + 340, 50, "depth of the probe", "force")
        picture.line([place((0, 2)), place((8.6, 2))], GREY, 1, "4 4")
        picture.text(place((8.7, 2.05)), "s", GREY)
        picture.text((place((4, 0))[0], 276), "s/k", GREY, "middle")
        picture.line([place(point) for point in law(depths)], RED, 2)
        picture.text((left + 40, 24), words)
    for start, end in (((1.5, 0.75), (2.5, 1.25)), ((4.6, 2.0), (5.6, 2.0)),
                       ((5.7, 1.6), (4.7, 1.1)), ((7.4, 1.7), (6.4, 1.2))):
        picture.arrow((60 + 33 * start[0], 260 - 80 * start[1]),
                      (60 + 33 * end[0], 260 - 80 * end[1]), RED)
    picture.text((60, 306), "500 N/m, strength 2 N: pressed to 6.5 mm, back to 3.2, to 8, and out")
    picture.write(folder, "play.svg")


def frame(folder):
    """The loop of one frame."""
    picture = Picture(760, 250)
    boxes = [(20, ["begin", "anchor at x0"]), (165, ["gather", "primitives (6)"]),
             (310, ["solve", "balance (7)"]), (455, ["step", "share (9) or", "curvature"]),
             (600, ["carry", "as far as", "certified"])]
    for left, words in boxes:
        picture.box(left, 60, 120, 70, words)
    for left, _ in boxes[:-1]:
        picture.arrow((left + 120, 95), (left + 145, 95))
    picture.line([(660, 130), (660, 160), (225, 160)])
    picture.arrow((225, 160), (225, 130))
    picture.text((440, 178), "until converged, at the cap, or out of time (8)", anchor="middle")
    picture.box(600, 185, 120, 50, ["commit", "levels move"], "#f3e3e0")
    picture.arrow((700, 130), (700, 185))
    picture.text((165, 40), "surfaces and effects know geometry", EDGE)
    picture.text((370, 148), "the solver knows forces only", BLUE, "middle")
    picture.text((660, 40), "surfaces know no forces", EDGE, "middle")
    picture.write(folder, "frame.svg")


def friction(folder):
    """A hand that drags the proxy over a plane: the proxy lags by mu lambda / k."""
    picture = Picture(700, 280)
    picture.area([(0, 120), (700, 120), (700, 280), (0, 280)])
    picture.line([(0, 120), (700, 120)], EDGE, 2)
    picture.text((690, 112), "surface", EDGE, "end")
    for x0, probe_x, words, color in ((70, 110, "holds: the proxy keeps its bits", BLUE),
                                      (330, 500, "slips: it follows, and lags", RED)):
        reach, depth = 60.0, 120.0  # mu lambda / k and lambda / k, pixels
        end = x0 if probe_x - x0 <= reach else probe_x - reach
        probe = (probe_x, 120 + depth)
        picture.line([(probe_x - reach, 120), probe, (probe_x + reach, 120)], GREY, 1, "4 3")
        picture.line([(end, 120), probe], color, 2)
        picture.dot(probe)
        picture.dot((end, 120), color, 5)
        if end != x0:
            picture.arrow((x0, 96), (end, 96), color)
            picture.dot((x0, 120), GREY, 3)
            picture.text((x0, 88), "x0", GREY, "middle")
            picture.line([(end, 140), (probe_x, 140)], color, 1)
            picture.text((probe_x + 8, 152), "mu lambda / k", color)
        else:
            picture.text((x0, 88), "x0 = x'", color, "middle")
        picture.text((probe[0] + 10, probe[1] + 5), "probe")
        picture.text((x0 - 40, 40), words, color)
    picture.text((20, 270), "grey: where the proxy may rest under this probe (cone of friction)")
    picture.write(folder, "friction.svg")


def edges(folder):
    """The nearest feature to a pull at an edge, in a cut across it: a ridge and a valley."""
    picture = Picture(760, 300)
    for left, rise, words in ((0, 1, "ridge"), (380, -1, "valley")):
        top = 120 if rise > 0 else 200
        edge, slope = (left + 190, top), 0.45 * rise
        ends = [(left + 20, top + 170 * slope), (left + 360, top + 170 * slope)]
        picture.area([ends[0], edge, ends[1], (left + 360, 300), (left + 20, 300)])
        picture.line([ends[0], edge, ends[1]], EDGE, 2)
        size = math.hypot(1, slope)
        for sign in (-1, 1):  # the facets' normals at the edge
            normal = (sign * slope / size, -1 / size)
            picture.arrow(edge, (edge[0] + 46 * normal[0], edge[1] + 46 * normal[1]), GREY, 1)
        picture.dot(edge, INK, 4)
        picture.text((left + 190, 290), words, anchor="middle")
        pulls = (((120, 90), "into the right facet", RED), ((0, -64), "lifts off", BLUE))
        if rise < 0:
            pulls = (((0, 46), "rests in the valley", RED),
                     ((110, -30), "into the right facet", BLUE))
        for (dx, dy), what, color in pulls:
            pull = (edge[0] + dx, edge[1] + dy)
            picture.dot(pull, color, 4)
            picture.line([edge, pull], color, 1, "3 3")
            picture.text((pull[0] + 8, pull[1] + 18), what, color, "start" if dx == 0 else "middle")
            if "facet" in what:
                along = (1 / size, slope / size)
                way = dx * along[0] + dy * along[1]
                foot = (edge[0] + way * along[0], edge[1] + way * along[1])
                picture.arrow(edge, foot, color, 2)
                picture.line([pull, foot], color, 1, "2 3")
    picture.text((20, 24), "grey: normals; dots: where a pull may be; arrows: the way it takes")
    picture.write(folder, "edges.svg")


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    for draw in (drift, energy, level_plane, play, frame, friction, edges):
        draw(folder)


if __name__ == "__main__":
    main()
