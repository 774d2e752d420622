#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How many instructions a frame and a sub-step need, counted by valgrind's callgrind.

    scripts/bench_instructions.py [--palpate COMMAND] [--only NAME ...] [--functions N] [--csv FILE]

The count is exact: the same command, scene and compiler give the same number on a loaded machine
too. Each scene is a small one that this script makes, and a path that is in contact from its
second frame on. A scene of a real skull is added where --skull names its volume.

frame     all of HapticLoop::frame, method adaptive: instructions by number of frames
advance   of these, Subdivision::advance: the movement of the proxy alone
sub-step  one more evaluation: (fixed with 33 sub-steps - fixed with 1) by the evaluations between

Exit status: 0 done, 2 usage, 3 no valgrind or no command, 1 anything else.
"""
import argparse
import concurrent.futures
import csv
import math
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile

FRAME = "palpate::HapticLoop::frame(palpate::DeviceState const&, std::span*"
SUBDIVISION = "palpate::Subdivision::"
ADVANCE = SUBDIVISION + "advance("
SUB_STEPS = (1, 33)  # of method fixed, whose difference is what a sub-step costs

SURFACE = '[[effect]]\ntype = "surface"\nsurface = "{0}"\n'
PATH = '[device]\ntype = "path"\nfile = "{0}.csv"\n'
PLANE = '[volume.wall]\nanalytic = "slab"\nthickness_mm = 200\n[surface.wall]\nvolume = "wall"\n'
BALL = '[surface.ball]\nmesh = "ball.ply"\nmesh_unit = "m"\n'
SOFT = "stiffness_n_per_mm = 0.2\n"  # behind the coupling's 0.5
SKIN = (
    '[volume.body]\nanalytic = "solid_sphere"\nradius_mm = 60\n'
    '[surface.bone]\nvolume = "body"\niso_value = 0.01\n'  # m: 10 mm beneath
    '[surface.skin]\nvolume = "body"\n' + SOFT
)
PLATE = '[surface.plate]\nmesh = "plate.ply"\nmesh_unit = "m"\n'
CT = '[volume.ct]\nfile = "{volume}"\n'
BONE = (
    '[surface.{contact}]\nvolume = "ct"\niso_value = 226\n'
    'smooth_voxels = 0.7\nkeep = "largest"\ncontact = "{contact}"\n'
    '[[effect]]\ntype = "surface"\nsurface = "{contact}"\n'
)


class Refused(Exception):
    """Said in one line; .status is the exit status."""

    def __init__(self, words, status=1):
        super().__init__(words)
        self.status = status


# Meshes and paths --------------------------------------------------------------------------------


def icosphere(radius, levels):
    """An icosahedron, each triangle cut into four `levels` times: 20 * 4^levels, turned so that no
    edge lies along an axis."""
    g = 0.5 * (1 + math.sqrt(5))
    points = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g)]
    points += [(0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4)]
    faces += [(11, 10, 2), (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8)]
    faces += [(3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]

    def unit(p):
        length = math.sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2])
        return (p[0] / length, p[1] / length, p[2] / length)

    points = [unit(p) for p in points]
    for _ in range(levels):
        middles, finer = {}, []

        def middle(a, b):
            key = (a, b) if a < b else (b, a)
            if key not in middles:
                middles[key] = len(points)
                points.append(unit([points[a][k] + points[b][k] for k in range(3)]))
            return middles[key]

        for a, b, c in faces:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = finer
    axis, angle = unit((0.3, -1.1, 0.7)), 1.234567

    def turned(p):
        along = (1 - math.cos(angle)) * sum(a * x for a, x in zip(axis, p))
        cross = [axis[k - 2] * p[k - 1] - axis[k - 1] * p[k - 2] for k in range(3)]
        return [
            radius * (math.cos(angle) * p[k] + math.sin(angle) * cross[k] + along * axis[k])
            for k in range(3)
        ]

    return [turned(p) for p in points], faces


def box(half):
    """A closed box around the origin, 12 triangles."""
    points = [[(1 if i >> k & 1 else -1) * half[k] for k in range(3)] for i in range(8)]
    faces = [(0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4), (2, 6, 7), (2, 7, 3)]
    return points, faces + [(0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5)]


def write_ply(file, mesh):
    points, faces = mesh
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}"]
    lines += [f"property double {axis}" for axis in "xyz"]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    with open(file, "wb") as out:
        out.write(("\n".join(lines) + "\n").encode())
        out.writelines(struct.pack("<3d", *p) for p in points)
        out.writelines(struct.pack("<B3i", 3, *f) for f in faces)


def write_path(file, trials):
    """Trials are lists of points in m, a frame of 1 ms each."""
    with open(file, "w", newline="") as out:
        rows = csv.writer(out)
        rows.writerow(["t_s", "x_m", "y_m", "z_m"])
        for trial in trials:
            rows.writerows([f"{i * 1e-3:.3f}", *map(repr, p)] for i, p in enumerate(trial))


def circle_over_plane(frames):
    """0.2 m/s on a circle of 20 mm, 2 mm behind the wall at z = 100 mm."""
    at = [i * 1e-3 * 0.2 / 0.02 for i in range(frames)]
    points = [(0.02 * math.cos(a), 0.02 * math.sin(a), 0.098) for a in at]
    return [[(*points[0][:2], 0.1001)] + points]


def round_in_ball(frames):
    """0.2 m/s around in a cavity of 50 mm, 5 mm behind its wall: the paper's circle."""
    at = [i * 1e-3 * 0.2 / 0.055 for i in range(frames)]
    return [[(0.0495, 0.0, 0.0)] + [(0.055 * math.cos(a), 0.055 * math.sin(a), 0.0) for a in at]]


def round_over_skin(frames):
    """0.2 m/s around a ball of 60 mm, 12 to 20 mm behind it: skin of 0.2 N/mm, and from 16.7 mm on
    bone of 50 mm beneath it."""
    at = [i * 1e-3 * 0.2 / 0.044 for i in range(frames)]
    depths = [0.016 + 0.004 * math.sin(3.0 * a) for a in at]
    points = [((0.06 - d) * math.cos(a), (0.06 - d) * math.sin(a), 0.0) for a, d in zip(at, depths)]
    return [[(0.0601, 0.0, 0.0)] + points]


def off_the_plate(frames):
    """2 m/s over a plate of 60 x 60 x 1 mm, 2.5 mm behind its face, and 20 mm beyond its edge."""
    trials, length = [], 27  # rows of a trial, which ends 50 mm from the middle
    for i in range(max(1, frames // length)):
        a = 2.399963 * i  # the golden angle: no direction twice
        along = [2e-3 * k for k in range(length - 1)]
        trials.append([(0.0, 0.0, 0.0006)] + [(s * math.cos(a), s * math.sin(a), -0.002) for s in along])
    return trials


# Scenes ------------------------------------------------------------------------------------------


class Case:
    """A scene: its tables, and the name of its path. `ct` is the table of the volume whose bone is
    felt, along an orbit that Palpate makes. `fixed`: whether method fixed is for it."""

    def __init__(self, words, text, path, ct="", fixed=True):
        self.words, self.text, self.path, self.ct, self.fixed = words, text, path, ct, fixed


def cases(skull):
    found = {
        "empty": Case("nothing to feel", "", "plane"),
        "plane": Case("wall by a formula, contact volume", PLANE + SURFACE.format("wall"), "plane"),
        "sphere": Case("mesh, sphere of 327,680 facets", BALL + SURFACE.format("ball"), "sphere"),
        "soft-plane": Case("the same wall, 0.2 N/mm", PLANE + SOFT + SURFACE.format("wall"), "plane"),
        "soft-sphere": Case("the same sphere, 0.2 N/mm", BALL + SOFT + SURFACE.format("ball"), "sphere"),
        "skin-bone": Case("skin of 0.2 N/mm over bone, by formulas",
                          SKIN + SURFACE.format("bone") + SURFACE.format("skin"), "skin", fixed=False),
        "plate": Case("mesh, slid off a plate at 2 m/s", PLATE + SURFACE.format("plate"), "plate"),
    }
    bones = [("ct", "generated CT", "ct.nrrd")]
    if skull:
        bones.append(("skull", "real head CT", str(skull.resolve())))
    for name, words, volume in bones:
        ct = CT.format(volume=volume)
        for contacts in (["volume"], ["guarded"], ["direct"], ["mesh"], ["volume", "mesh"]):
            text = ct + "".join(BONE.format(contact=contact) for contact in contacts)
            words_of = f"{words}, contact {' and '.join(contacts)}"
            found[f"{name}-{'+'.join(contacts)}"] = Case(words_of, text, name, ct)
    return found


class Bench:
    """A folder with the files of all scenes, and the command that runs them."""

    def __init__(self, folder, command, frames):
        self.folder, self.command, self.frames = folder, command, frames
        self.environment = dict(os.environ, PALPATE_CACHE=str(folder / "cache"))

    def palpate(self, *arguments, before=()):
        done = subprocess.run(
            [*before, self.command, *map(str, arguments)],
            cwd=self.folder, env=self.environment, capture_output=True, text=True, check=False,
        )
        if done.returncode != 0:
            said = [line for line in done.stderr.splitlines() if "palpate:" in line]
            raise Refused((said or done.stderr.splitlines()[-1:] or ["no words"])[0])
        return done.stderr

    def prepare(self, wanted):
        """Meshes, volumes, paths; and what Palpate keeps in its cache, so that none of it is made
        under valgrind."""
        paths = {case.path for case in wanted.values()}
        write_path(self.folder / "plane.csv", circle_over_plane(self.frames))
        if any("ball.ply" in case.text for case in wanted.values()):
            write_ply(self.folder / "ball.ply", icosphere(0.05, 7))
            write_path(self.folder / "sphere.csv", round_in_ball(self.frames))
        if "skin" in paths:
            write_path(self.folder / "skin.csv", round_over_skin(self.frames))
        if "plate" in paths:
            write_ply(self.folder / "plate.ply", box((0.03, 0.03, 0.0005)))
            write_path(self.folder / "plate.csv", off_the_plate(self.frames))
        if "ct" in paths:
            self.palpate("phantom", "ct.nrrd")
        for case in wanted.values():
            if case.ct and not (self.folder / f"{case.path}.csv").exists():
                self.write_orbit(case)
        for name, case in wanted.items():
            (self.folder / f"{name}.toml").write_text(case.text + PATH.format(case.path))
            if case.ct:  # extracts the mesh
                self.palpate("trace", f"{name}.toml", "--frames", 1, "--out", f"{name}-made")

    def write_orbit(self, case):
        """The probe's way of an orbit at 0.2 m/s, 1 to 5 mm deep."""
        orbit = f'[device]\ntype = "orbit"\nduration_s = {1e-3 * self.frames}\n'
        (self.folder / "orbit.toml").write_text(case.ct + BONE.format(contact="volume") + orbit)
        self.palpate("trace", "orbit.toml", "--out", "orbit")
        trials = {}
        for row in rows_of(self.folder / "orbit" / "frames.csv"):
            point = [float(row[f"probe_{axis}_m"]) for axis in "xyz"]
            trials.setdefault(row["trial"], []).append(point)
        write_path(self.folder / f"{case.path}.csv", trials.values())

    def count(self, name, method, sub_steps=None):
        """Runs a scene under callgrind."""
        out = f"{name}-{method}-{sub_steps}"
        options = ["--method", method] + (["--sub-steps", sub_steps] if sub_steps else [])
        profile = self.folder / f"{out}.callgrind"
        self.palpate(
            "trace", f"{name}.toml", "--out", out, *options,
            before=["valgrind", "--tool=callgrind", f"--callgrind-out-file={profile}",
                    "--collect-atstart=no", f"--toggle-collect={FRAME}"],
        )
        return Counted(profile, rows_of(self.folder / out / "frames.csv"))


def rows_of(file):
    with open(file, newline="") as lines:
        return list(csv.DictReader(line for line in lines if not line.startswith("#")))


class Counted:
    """What callgrind counted of a run, by frame."""

    def __init__(self, profile, rows):
        self.frames = len(rows)
        self.contacts = sum(int(row["contacts"]) > 0 for row in rows) / self.frames
        self.evaluations = sum(int(row["evaluations"]) for row in rows) / self.frames
        total, self.own, self.inclusive = read_callgrind(profile)
        self.frame = total / self.frames
        if total == 0:
            raise Refused(f"{profile.name}: nothing was counted: the command has no symbols")
        self.advance = self.of(ADVANCE)

    def of(self, name):
        """Instructions by frame in the functions whose names begin so, with all that they call."""
        return sum(n for full, n in self.inclusive.items() if full.startswith(name)) / self.frames


def read_callgrind(file):
    """The total, and by function: its own instructions, and those with all that it calls. The
    advance() of a soft layer is called within that of its tip, and is part of it.
    Format: https://valgrind.org/docs/manual/cl-format.html"""
    names, own, called = {}, {}, {}

    def name(text):
        key, full = re.match(r"\((\d+)\)\s*(.*)", text).groups()
        if full:
            names[key] = full
        return names[key]

    total, function, target, is_call = 0, None, None, False
    for line in file.read_text().splitlines():
        if line.startswith("fn="):
            function = name(line[3:])
        elif line.startswith("cfn="):
            target = name(line[4:])
        elif line.startswith("calls="):
            is_call = True
        elif line and line[0] in "0123456789+-*":
            numbers = line.split()
            cost = int(numbers[1]) if len(numbers) > 1 else 0
            if is_call and target.startswith(ADVANCE) and function.startswith(SUBDIVISION):
                is_call = False
            elif is_call:
                called[target] = called.get(target, 0) + cost
                is_call = False
            else:
                own[function] = own.get(function, 0) + cost
        elif line.startswith(("summary:", "totals:")):
            total = int(line.split()[1])
    return total, own, {**own, **called}


# What is said ------------------------------------------------------------------------------------


def measure(bench, wanted, jobs, sub_steps):
    """{name: {quantity: number}}; the runs side by side, which changes no count."""
    runs = [(name, "adaptive", None) for name in wanted]
    if sub_steps:
        runs += [(name, "fixed", n) for name in wanted if wanted[name].fixed for n in SUB_STEPS]
    counted = {}
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        waiting = {pool.submit(bench.count, *run): run for run in runs}
        for one in concurrent.futures.as_completed(waiting):
            counted[waiting[one]] = one.result()
            if sys.stderr.isatty():
                end = "\n" if len(counted) == len(runs) else ""
                print(f"\r{len(counted)} of {len(runs)} runs", end=end, file=sys.stderr, flush=True)
    return counted


def sub_step(counted, name):
    few, many = (counted.get((name, "fixed", n)) for n in SUB_STEPS)
    if not few or many.evaluations <= few.evaluations:
        return None
    return (many.frame - few.frame) / (many.evaluations - few.evaluations)


def table(wanted, counted):
    """Rows of scene, frame, advance, sub-step, evaluations, share of frames in contact."""
    for name, case in wanted.items():
        run = counted[name, "adaptive", None]
        yield name, case.words, run.frame, run.advance, sub_step(counted, name), run


def print_table(wanted, counted):
    print(f"{'scene':18s}{'frame':>8s}{'advance':>9s}{'sub-step':>10s}"
          f"{'evaluations':>13s}{'in contact':>12s}")
    for name, words, frame, advance, step, run in table(wanted, counted):
        step = "-" if step is None else f"{step:.0f}"
        print(f"{name:18s}{frame:8.0f}{advance:9.0f}{step:>10s}"
              f"{run.evaluations:13.2f}{100 * run.contacts:10.1f} %  {words}")


def print_functions(wanted, counted, most):
    """Where a frame's instructions are."""
    for name in wanted:
        run = counted[name, "adaptive", None]
        print(f"\n{name}: instructions by frame\n{'with calls':>10s}{'own':>8s}")
        called = [item for item in run.inclusive.items() if run.own.get(item[0])]  # not main()
        for function, instructions in sorted(called, key=lambda item: -item[1])[:most]:
            own = run.own[function] / run.frames
            print(f"{instructions / run.frames:10.1f}{own:8.1f}  {function[:110]}")


def write_csv(file, wanted, counted):
    part = file.with_name(file.name + ".part")
    with open(part, "w", newline="") as out:
        rows = csv.writer(out, lineterminator="\n")
        rows.writerow(["benchmark", "quantity", "unit", "runs", "median", "least", "most"])
        for name, _, frame, advance, step, _ in table(wanted, counted):
            for quantity, value in (("frame", frame), ("advance", advance), ("sub_step", step)):
                if value is not None:
                    number = f"{value:.1f}"
                    rows.writerow([f"instructions/{name}", quantity, "instructions", 1] + 3 * [number])
    part.rename(file)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--palpate", metavar="COMMAND", type=pathlib.Path, default="build/release/palpate",
                        help="the command that is measured (build/release/palpate)")
    parser.add_argument("--only", metavar="NAME", nargs="+", help="these scenes alone")
    parser.add_argument("--skull", metavar="VOLUME", type=pathlib.Path, help="a real head CT besides")
    parser.add_argument("--frames", metavar="N", type=int, default=2000, help="of each path (2000)")
    parser.add_argument("--no-sub-steps", action="store_true", help="frames alone: a third of the time")
    parser.add_argument("--functions", metavar="N", type=int, help="the N dearest functions of a frame")
    parser.add_argument("--csv", metavar="FILE", type=pathlib.Path, help="the numbers as a table")
    parser.add_argument("--jobs", metavar="N", type=int, default=os.cpu_count(), help="runs at a time")
    options = parser.parse_args()
    if options.frames < 100:
        parser.error("--frames: at least 100, so that the first one does not count")
    for name in ("jobs", "functions"):
        if getattr(options, name) is not None and getattr(options, name) < 1:
            parser.error(f"--{name} {getattr(options, name)}: at least 1")
    if options.csv and (options.csv.is_dir() or not os.access(options.csv.parent, os.W_OK)):
        parser.error(f"--csv {options.csv}: cannot be written; name a file in a folder that is there")
    options.scenes = cases(options.skull)
    unknown = [name for name in options.only or [] if name not in options.scenes]
    if unknown:
        parser.error(f"--only: no scene {unknown[0]}; there are {', '.join(options.scenes)}")
    if options.only:
        options.scenes = {name: options.scenes[name] for name in options.only}
    return options


def main():
    options = arguments()
    if not shutil.which("valgrind"):
        raise Refused("valgrind is not installed; apt-get install valgrind", 3)
    if not options.palpate.is_file():
        raise Refused(f"{options.palpate}: no such command; ./palpate.sh build makes it", 3)
    if options.skull and not options.skull.is_file():
        raise Refused(f"{options.skull}: no such file; scripts/fetch_data.sh gets it", 3)
    with tempfile.TemporaryDirectory(prefix="palpate-instructions-") as folder:
        bench = Bench(pathlib.Path(folder), str(options.palpate.resolve()), options.frames)
        bench.prepare(options.scenes)
        counted = measure(bench, options.scenes, options.jobs, not options.no_sub_steps)
        print_table(options.scenes, counted)
        if options.functions:
            print_functions(options.scenes, counted, options.functions)
        if options.csv:
            write_csv(options.csv, options.scenes, counted)


if __name__ == "__main__":
    try:
        main()
    except Refused as words:
        print(f"bench_instructions.py: {words}", file=sys.stderr)
        sys.exit(words.status)
