#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a build cost, and which sources cost most: from what ninja writes down of each command.

    scripts/build_cost.py [--most N] BUILD...       BUILD: a build folder, such as build/release

The seconds are those of a command by the wall. With as many jobs as cores, and nothing else on the
machine, they are seconds of processor. A command that ran again counts as it ran last. To see what a cold
build costs, build with an empty CCACHE_DIR.
Sums are by folder of the sources, and by the libraries whose headers a source includes: a source with two of
them counts in both.
"""
import argparse
import collections
import pathlib
import re
import signal
import subprocess
import sys

LIBRARIES = {  # a library: what the paths of its headers have in them
    "CGAL": "/CGAL/", "ITK": "/ITK-", "OpenVDB": "/openvdb/", "GDCM": "/gdcm-", "toml++": "/toml++/",
    "nlohmann-json": "/nlohmann/", "CLI11": "/CLI/", "fmt": "/fmt/", "pybind11": "/pybind11/", "Embree": "/embree3/",
    "HDF5": "/hdf5/", "GoogleTest": "/gtest/", "GoogleMock": "/gmock/", "Google Benchmark": "/benchmark/",
}


def commands(build):
    """(seconds, output) of each command that ran, once; of several outputs of a command, the first."""
    last = {}
    for line in (build / ".ninja_log").read_text().splitlines():
        fields = line.split("\t")
        if len(fields) == 5:
            start, end, _, output, command = fields
            last[output] = (int(start), int(end), command)
    seen = set()
    for output, key in sorted(last.items()):
        if key not in seen:
            seen.add(key)
            yield (key[1] - key[0]) / 1000, output


def headers(build):
    """{output: the files that its compiler read}."""
    text = subprocess.run(["ninja", "-C", str(build), "-t", "deps"], capture_output=True, text=True, check=True).stdout
    found, output = {}, None
    for line in text.splitlines():
        if line.startswith("    "):
            found[output].append(line.strip())
        elif ": #deps" in line:
            output = line.split(": #deps")[0]
            found[output] = []
    return found


def source_of(output):
    """A source as in the tree: .../CMakeFiles/TARGET.dir/SOURCE.o -> SOURCE with the folder of its CMakeLists.txt."""
    match = re.fullmatch(r"(.*?)CMakeFiles/[^/]+\.dir/(.+)\.(o|gch)", output)
    if not match:
        return None
    folder, source, _ = match.groups()
    if source.startswith("__/"):
        return source.replace("__/", "")
    return folder + source


def folder_of(source):
    parts = source.split("/")
    if "cmake_pch" in source:
        return "precompiled headers"
    return "/".join(parts[:2]) if len(parts) > 2 else parts[0]


def table(title, rows, most=None):
    print(f"\n{title}")
    for name, (count, seconds) in sorted(rows.items(), key=lambda row: -row[1][1])[:most]:
        print(f"  {seconds:8.1f} s  {count:4d}  {name}")


def report(build, most):
    by_folder = collections.defaultdict(lambda: (0, 0.0))
    by_library = collections.defaultdict(lambda: (0, 0.0))
    sources, total, count = [], 0.0, 0
    included = headers(build)

    def add(rows, name, seconds):
        rows[name] = (rows[name][0] + 1, rows[name][1] + seconds)

    for seconds, output in commands(build):
        total += seconds
        count += 1
        source = source_of(output)
        if source is None:
            add(by_folder, "links, tests' lists and other commands", seconds)
            sources.append((seconds, output))
            continue
        text = "\n".join(included.get(output, []))
        libraries = [name for name, part in LIBRARIES.items() if part in text]
        add(by_folder, folder_of(source), seconds)
        for name in libraries or ["none of these"]:
            add(by_library, name, seconds)
        sources.append((seconds, f"{source}  ({', '.join(libraries)})" if libraries else source))
    print(f"{build}: {count} commands, {total / 60:.1f} minutes")
    table("by folder:", by_folder)
    table("by library whose headers are included:", by_library)
    print(f"\nthe {most} dearest:")
    for seconds, name in sorted(sources, reverse=True)[:most]:
        print(f"  {seconds:8.1f} s  {name}")
    return total


def main():
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # as when head has read enough
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("builds", metavar="BUILD", nargs="+", type=pathlib.Path)
    parser.add_argument("--most", metavar="N", type=int, default=40, help="how many of the dearest (40)")
    options = parser.parse_args()
    for build in options.builds:
        if not (build / ".ninja_log").is_file():
            sys.exit(f"build_cost.py: {build}: no .ninja_log: not a folder that ninja has built in")
    total = sum(report(build, options.most) for build in options.builds)
    if len(options.builds) > 1:
        print(f"\nall of them: {total / 60:.1f} minutes")


if __name__ == "__main__":
    main()
