#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the tracks of the open benchmark (docs/benchmark.md).

    tracks.py OUT [--seed N] [--track NAME ...] [--skull FOLDER] [--check MANIFEST]

OUT/NAME/ gets path.csv, shape.txt and, for a mesh, mesh.obj; OUT/manifest.json the SHA-256 of each.
Seed 1 is the frozen one: the same bytes on every machine, compared by --check with the manifest in
the repository. FOLDER: where scripts/fetch_data.sh has put the skull; without it that track is left
out. Exit status: 0 done, 1 a hash differs, 2 wrong usage or input.
"""

import argparse
import hashlib
import json
import pathlib

from program import (BadInput, check_writable, end_with, make_folder, read_text,
                     say, write_whole)  # fmt: skip

import numpy as np

import shapes
from exact import Random, combine, cosine, sine

FORMAT = "palpate open benchmark 1"
MANIFEST = pathlib.Path(__file__).resolve().parent / "manifest.json"  # of the frozen tracks
FROZEN_SEED = 1
PERIOD_S = 1e-3
STIFFNESS_N_PER_M = 500
SPEEDS_M_PER_S = (0.05, 0.2, 0.5)
SKULL_LEVEL = 226.5  # HU; between two integers
SKULL_PART = (slice(32, 96), slice(64, 128), slice(20, 50))  # i, j, k of voxels twice as large
SKULL_SHA256 = "d87fd5e6aaf2c4fdf4f3fe28ee3335192fc2464ed8e9682fc78530cb837938da"


def orbit(random, radius_mm, most_mm):
    """Three trials of 1000 frames along great circles that sway: from free space to most_mm deep,
    out again, and so on. Positions (n, 3), mm."""
    trials = []
    for speed in SPEEDS_M_PER_S:
        axes = random.axes()
        n = np.arange(1000.0)
        along = n * (speed / (6.28 * radius_mm)) + random.uniform(0, 1)  # turns; mm in a frame
        across = 0.06 * sine(n * random.uniform(0.0005, 0.002) + random.uniform(0, 1))
        wave = sine(n * random.uniform(0.0015, 0.003) + random.uniform(0, 1))
        depth = most_mm * (0.375 + 0.625 * wave)  # -0.25 to 1 of it
        begin = np.minimum(n / 100, 1)
        r = radius_mm + depth * begin - 5 * (1 - begin)
        circle = [cosine(along) * cosine(across), sine(along) * cosine(across), sine(across)]
        trials.append(combine([r * c for c in circle], axes))
    return trials


def strokes(random, x_from_mm, x_to_mm, high_mm, deepest_mm, speeds):
    """A trial for each speed: over x at a depth of its own. It comes down from high_mm within the
    first 10 mm (high_mm < 0: it is at its depth at once) and sways along y. Where it begins is
    drawn: below an edge rounding would decide on which side of it the proxy goes."""
    trials = []
    for speed in speeds:
        length_mm = abs(x_to_mm - x_from_mm)
        n = np.arange(np.rint(length_mm / speed))  # 1 m/s is 1 mm in a frame
        way = (n + random.uniform(0, 1)) * speed
        forth = 1 if random.uniform(0, 1) < 0.5 else -1
        z = -random.uniform(0.3, 1.0) * deepest_mm + 0.0 * n
        if high_mm > 0:
            z = high_mm + (z - high_mm) * np.minimum(way / 10, 1)
        y = random.uniform(-20, 20) + 5 * sine(way / 100 + random.uniform(0, 1))
        x = x_from_mm + way if x_to_mm > x_from_mm else x_from_mm - way
        trials.append(np.stack([forth * x, y, z], axis=1))
    return trials


def sphere(random, _):
    radius_mm = round(random.uniform(45, 55), 3)
    shape = [("shape", "sphere_cavity"), ("radius_mm", radius_mm)]
    return shape, None, lambda: orbit(random, radius_mm, 4)


def bumps(random, _):
    radius_mm, wavelength_mm = round(random.uniform(45, 55), 3), round(random.uniform(14, 17), 3)
    shape = [("shape", "bumpy_cavity"), ("radius_mm", radius_mm), ("amplitude_mm", 0.5),
             ("wavelength_mm", wavelength_mm)]  # fmt: skip
    return shape, None, lambda: orbit(random, radius_mm, 1.5)


def _ball(levels):
    def track(random, _):
        radius_mm = round(random.uniform(45, 55), 3)
        mesh = shapes.cavity(radius_mm, levels, random.axes())
        shape = [("shape", "mesh"), ("free_space", "convex")]
        return shape, mesh, lambda: orbit(random, radius_mm, 4)

    return track


def _prism(profile_mm, bottom_mm, draw):
    flat = [round(float(v), 6) + 0.0 for point in profile_mm for v in point]  # no -0
    profile_mm = list(zip(flat[::2], flat[1::2]))
    shape = [("shape", "profile"), ("profile_mm", " ".join(f"{v:.6f}" for v in flat)),
             ("bottom_mm", f"{bottom_mm:.6f}"), ("half_length_mm", 50)]  # fmt: skip
    return shape, shapes.prism(profile_mm, bottom_mm, 50, 2), draw


def plate(random, _):
    edge_mm = round(random.uniform(35, 45), 3)
    speeds = [0.2, 0.2, 0.5, 0.5, 0.5, 1, 1, 1, 2, 2, 2, 2, 2, 2, 2, 2]
    return _prism([(-edge_mm, 0), (edge_mm, 0)], -4,
                  lambda: strokes(random, edge_mm - 35, edge_mm + 15, 2, 3, speeds))  # fmt: skip


def wedge(random, _):
    height_mm = round(random.uniform(15, 45), 3)
    speeds = [0.02, 0.05, 0.1, 0.1, 0.2, 0.2, 0.2, 0.5, 0.5, 0.5, 1, 1, 2, 2]
    return _prism([(-30, -height_mm), (0, 0), (30, -height_mm)], -height_mm - 5,
                  lambda: strokes(random, -8, 8, -1, 3, speeds))  # fmt: skip


def grooves(random, _):
    pitch_mm, deep_mm = round(random.uniform(4, 8), 3), round(random.uniform(1, 3), 3)
    half = [(pitch_mm * i / 2, -deep_mm * (i % 2)) for i in range(-6, 7)]
    profile = [(half[0][0] - 10, 0), *half, (half[-1][0] + 10, 0)]
    end_mm = half[-1][0] + 5
    speeds = [0.1, 0.2, 0.2, 0.5, 0.5, 1, 1, 2, 2, 2]
    return _prism(profile, -deep_mm - 8,
                  lambda: strokes(random, -end_mm, end_mm, 2, deep_mm + 1.5, speeds))  # fmt: skip


def skull(random, folder):
    values = np.fromfile(folder / "skull.raw", "<i2").reshape(108, 256, 256).transpose(2, 1, 0)
    eighth = sum(values[i::2, j::2, k::2].astype(np.int64) for i in (0, 1) for j in (0, 1)
                 for k in (0, 1))[SKULL_PART]  # fmt: skip
    level = 8 * SKULL_LEVEL
    walled = np.pad(eighth, 1, constant_values=-8000)
    points, triangles = shapes.level_of(walled, level + 0.5)
    # Indices run to the left, to the front and up; y of LPS runs to the back, which turns the
    # triangles round.
    size_mm, middle = np.array([1.9140624, -1.9140624, 3.0]), np.array(walled.shape) / 2
    mesh = (points - middle) * size_mm, triangles[:, ::-1]
    return [("shape", "mesh")], mesh, lambda: _over_the_front(random, walled > level, size_mm,
                                                              middle)  # fmt: skip


def _over_the_front(random, bone, size_mm, middle):
    """Strokes over the smoothed front of the bone, from 30 mm before it to 2 mm behind it."""
    front = np.where(bone.any(axis=1), bone.shape[1] - 1 - bone[:, ::-1].argmax(axis=1), 0.0)
    for _ in range(12):  # means of neighbours
        for axis in (0, 1):
            front = (np.roll(front, 1, axis) + front + np.roll(front, -1, axis)) / 3
    trials = []
    for speed in SPEEDS_M_PER_S:
        n = np.arange(1000.0) * (speed / 400)  # turns around a curve of some 400 mm
        i = middle[0] * (1 + 0.5 * sine(n + random.uniform(0, 1)))
        k = middle[2] * (1 + 0.5 * sine(n * 2 + random.uniform(0, 1)))
        low_i, low_k = np.floor(i).astype(int), np.floor(k).astype(int)
        s, t = i - low_i, k - low_k
        at = [front[low_i + a, low_k + b] for a in (0, 1) for b in (0, 1)]
        j = (1 - s) * ((1 - t) * at[0] + t * at[1]) + s * ((1 - t) * at[2] + t * at[3])
        deep_mm = 1 + sine(n * 7 + random.uniform(0, 1)) - 30 * np.maximum(1 - 5 * n / n[-1], 0)
        position = np.stack([i, j, k], axis=1)
        trials.append((position - middle) * size_mm + deep_mm[:, None] * [0.0, 1.0, 0.0])
    return trials


# Of each: what shape.txt says, the mesh, and what draws a round of trials (positions in mm).
TRACKS = {
    "sphere": sphere, "bumps": bumps, "sphere_20k": _ball(5), "sphere_330k": _ball(7),
    "plate": plate, "wedge": wedge, "grooves": grooves, "skull": skull,
}  # fmt: skip


def path_text(trials):
    rows = ["t_s,x_m,y_m,z_m"]
    for trial in trials:
        for n, (x, y, z) in enumerate(trial / 1000):
            rows.append(f"{n * PERIOD_S:.3f},{x:.9f},{y:.9f},{z:.9f}")
    return "\n".join(rows) + "\n"


def mesh_text(mesh):
    points, triangles = mesh
    rows = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in points.tolist()]
    rows += [f"f {a} {b} {c}" for a, b, c in (triangles + 1).tolist()]
    return "# mm; counter-clockwise as seen from free space\n" + "\n".join(rows) + "\n"


def write_track(out, name, seed, skull_folder=None, rounds=range(1)):
    """Writes a track's folder; what the manifest says of it. Its path has these rounds of trials,
    each drawn after the others: round 0 is that of the frozen tracks."""
    shape, mesh, draw = TRACKS[name](Random(seed, name), skull_folder)
    drawn = [draw() for _ in range(rounds.stop)]
    trials = [trial for i in rounds for trial in drawn[i]]
    shape = [*shape, ("stiffness_n_per_m", STIFFNESS_N_PER_M)]
    texts = {"path.csv": path_text(trials), "shape.txt": "".join(f"{k} {v}\n" for k, v in shape)}
    if mesh:
        texts["mesh.obj"] = mesh_text(mesh)
    make_folder(out / name)
    entry = {"frames": sum(map(len, trials)), "triangles": len(mesh[1]) if mesh else 0, "sha256": {}}
    for file, text in sorted(texts.items()):
        write_whole(out / name / file, text)
        entry["sha256"][file] = hashlib.sha256(text.encode()).hexdigest()
    return entry


def write_tracks(out, seed, names=None, skull_folder=None):
    """Writes tracks (None: all) and their manifest; what is written, by name."""
    names = [name for name in names or TRACKS if name != "skull" or skull_folder]
    file, manifest = out / "manifest.json", {"format": FORMAT, "seed": seed, "tracks": {}}
    if file.is_file():  # tracks of this seed that were written before stay in it
        before = read_manifest(file)
        manifest = before if (before["format"], before["seed"]) == (FORMAT, seed) else manifest
    make_folder(out)
    check_writable(file)
    entries = {name: write_track(out, name, seed, skull_folder) for name in names}
    manifest["tracks"] |= entries
    write_whole(file, json.dumps(manifest, indent=1) + "\n")
    return entries


def read_manifest(file):
    """Format, seed, and the SHA-256 of each file by track."""
    try:
        found = json.loads(read_text(file))
        for track in found["tracks"].values():
            dict(track["sha256"])
        return {"format": found["format"], "seed": found["seed"], "tracks": found["tracks"]}
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        at = f":{error.lineno}" if isinstance(error, json.JSONDecodeError) else ""
        raise BadInput(f"{file}{at}: is no manifest of tracks; give one that tracks.py has "
                       f"written, such as {MANIFEST}") from error  # fmt: skip


def is_frozen(folder):
    """Whether a track's files are those of the manifest in the repository."""
    frozen = read_manifest(MANIFEST)["tracks"].get(folder.name)
    return frozen is not None and all(
        (folder / file).is_file()
        and hashlib.sha256((folder / file).read_bytes()).hexdigest() == sha256
        for file, sha256 in frozen["sha256"].items()
    )


def check_skull(folder):
    """Refuses a folder without the skull's data."""
    file = folder / "skull.raw"
    if not file.is_file():
        raise BadInput(f"{file}: is not there; get it with scripts/fetch_data.sh {folder} skull")
    found = hashlib.sha256(file.read_bytes()).hexdigest()
    if found != SKULL_SHA256:
        raise BadInput(f"{file}: is not the file of the benchmark: SHA-256 {found}; get it with "
                       f"scripts/fetch_data.sh {folder} skull")  # fmt: skip


def differences(entries, frozen):
    """What of the entries is not as in the frozen manifest, a line each."""
    for name, entry in entries.items():
        for file, sha256 in entry["sha256"].items():
            expected = frozen["tracks"].get(name, {}).get("sha256", {}).get(file, "nothing")
            if sha256 != expected:
                yield f"{name}/{file}: SHA-256 is {sha256}, the manifest has {expected}"


def main():
    parser = argparse.ArgumentParser(description="Writes the tracks of the open benchmark.")
    parser.add_argument("out", type=pathlib.Path, metavar="OUT",
                        help="gets a folder for each track")  # fmt: skip
    parser.add_argument("--seed", type=int, default=FROZEN_SEED, metavar="N",
                        help="of which all numbers are drawn (1: the frozen tracks)")  # fmt: skip
    parser.add_argument("--track", nargs="+", choices=TRACKS, metavar="NAME",
                        help=f"these alone, of {', '.join(TRACKS)}")  # fmt: skip
    parser.add_argument("--skull", type=pathlib.Path, metavar="FOLDER",
                        help="where scripts/fetch_data.sh has put the skull")  # fmt: skip
    parser.add_argument("--check", type=pathlib.Path, metavar="MANIFEST",
                        help="compare with the SHA-256 of this manifest")  # fmt: skip
    options = parser.parse_args()
    frozen = options.check and read_manifest(options.check)
    if options.skull:
        check_skull(options.skull)
    elif "skull" in (options.track or []):
        raise BadInput("--track skull: needs its data; get it with scripts/fetch_data.sh FOLDER "
                       "skull, then give --skull FOLDER")  # fmt: skip
    elif not options.track:
        say("skull: left out: its data is not there; get it with scripts/fetch_data.sh FOLDER "
            "skull, then give --skull FOLDER")  # fmt: skip
    entries = write_tracks(options.out, options.seed, options.track, options.skull)
    for name, entry in entries.items():
        print(f"{name}: {entry['frames']} frames, {entry['triangles']} triangles")
    if frozen:
        wrong = list(differences(entries, frozen))
        print("\n".join(wrong) if wrong else "all hashes are those of the manifest")
        return 1 if wrong else 0
    return 0


if __name__ == "__main__":
    end_with(main)
