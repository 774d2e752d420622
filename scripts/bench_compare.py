#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Names what got slower from one run of the benchmarks to another by more than their noise.

    scripts/bench_compare.py BEFORE.csv AFTER.csv [--least PERCENT] [--all]

Both are tables of ./palpate.sh bench, such as those in bench/results. Times and instructions are
compared, but for maxima, which one interruption decides. A quantity got slower where its median
grew by more than the spreads (most - least) of both tables together, and by more than PERCENT (5);
instructions, which have no spread, by more than 0.1 %. So compare runs of the same machine, of
several repetitions each, that nothing else disturbed.

Exit status: 0 nothing got slower, 1 something did, 2 usage, 3 a table cannot be read.
"""
import argparse
import signal
import sys

from bench_results import BadInput, read_csv

COMPARED = ("ns", "us", "ms", "s", "instructions")
LEAST_OF_INSTRUCTIONS = 0.1  # percent; where the compiler puts a function may cost one more
OF_THE_MACHINE = ("processor", "caches", "system", "compiler")


def is_compared(row):
    return row.unit in COMPARED and "max_" not in row.quantity


def changed(before, after, least_percent):
    """-1 faster, 1 slower, 0 neither by more than the noise."""
    change = after.median - before.median
    noise = before.spread + after.spread
    if before.unit == "instructions":
        least_percent = min(least_percent, LEAST_OF_INSTRUCTIONS)
    if abs(change) <= noise or abs(change) <= 0.01 * least_percent * before.median:
        return 0
    return 1 if change > 0 else -1


def print_rows(title, pairs):
    if not pairs:
        return
    print(f"{title}: {len(pairs)}")
    for before, after in pairs:
        percent = 100.0 * (after.median / before.median - 1.0) if before.median else float("inf")
        noise = before.spread + after.spread
        print(f"  {before.benchmark}  {before.quantity}  {before.median:g} -> {after.median:g} "
              f"{before.unit}  {percent:+.1f} %  (noise {noise:g})")


def print_names(title, names):
    if names:
        print(f"{title}: {len(names)}")
        for name in names:
            print(f"  {name}")


def compare(before, after, options):
    """Prints what differs; whether something got slower."""
    for key in OF_THE_MACHINE:
        if before.machine.get(key) != after.machine.get(key):
            print(f"bench_compare.py: {key} differs: {before.machine.get(key, 'not said')} / "
                  f"{after.machine.get(key, 'not said')}; times are not comparable", file=sys.stderr)
    both = [(row, after.rows[key]) for key, row in before.rows.items()
            if key in after.rows and is_compared(row)]
    for a, b in both:
        if a.unit != b.unit:
            raise BadInput(f"{options.after}: {b.benchmark} {b.quantity} is in {b.unit}, before in "
                           f"{a.unit}; compare tables of one version of the benchmarks")
    if not both:
        raise BadInput(f"{options.after}: no row in common with {options.before}; compare tables of "
                       "the same benchmarks")
    by_change = {-1: [], 0: [], 1: []}
    for pair in both:
        by_change[changed(*pair, options.least)].append(pair)
    for pairs in by_change.values():
        pairs.sort(key=lambda pair: pair[1].median / pair[0].median if pair[0].median else 0.0)
    print_rows("slower", by_change[1][::-1])
    print_rows("faster", by_change[-1])
    if options.all:
        print_rows("the same within the noise", by_change[0])
    else:
        print(f"the same within the noise: {len(by_change[0])}")
    names = [dict.fromkeys(name for name, _ in results.rows) for results in (before, after)]
    print_names("only before", [name for name in names[0] if name not in names[1]])
    print_names("only after", [name for name in names[1] if name not in names[0]])
    return bool(by_change[1])


def main():
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # as when head has read enough
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before", metavar="BEFORE.csv")
    parser.add_argument("after", metavar="AFTER.csv")
    parser.add_argument("--least", metavar="PERCENT", type=float, default=5.0,
                        help="smaller changes are not named (5)")
    parser.add_argument("--all", action="store_true", help="also what stayed the same, row by row")
    options = parser.parse_args()
    if not options.least >= 0.0:
        parser.error("--least: at least 0")
    try:
        return 1 if compare(read_csv(options.before), read_csv(options.after), options) else 0
    except BadInput as words:
        print(f"bench_compare.py: {words}", file=sys.stderr)
        return 3


if __name__ == "__main__":
    sys.exit(main())
