#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Names what got slower from one run of the benchmarks to another by more than their noise.

    scripts/bench_compare.py BEFORE.csv AFTER.csv [--least PERCENT] [--all]

Both are tables of ./palpate.sh bench, such as those in bench/results. Times and instructions are
compared, but for maxima, which one interruption decides. A quantity got slower where its median
grew by more than its noise and by more than PERCENT (5). The noise is the sum of the two spreads
(most - least of each table); the spread of a single run is not known and counts as 0, which is
said. Instructions have no noise: 0.1 % more of them is slower. So compare runs of the same machine,
of several repetitions each, that nothing else disturbed.

Exit status: 0 nothing got slower and AFTER has all numbers of BEFORE, 1 something got slower,
2 usage, 3 a table cannot be read, 4 nothing got slower, but AFTER lacks numbers of BEFORE.
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


def noise_of(before, after):
    return before.spread + after.spread


def is_of_one_run(before, after):
    """Whether a spread is not known, though there is one."""
    return before.unit != "instructions" and min(before.runs, after.runs) == 1


def verdict(before, after, least_percent):
    """In one of the four lists that are printed."""
    change = after.median - before.median
    if before.unit == "instructions":
        least_percent = min(least_percent, LEAST_OF_INSTRUCTIONS)
    if abs(change) <= noise_of(before, after):
        return "same"
    if abs(change) <= 0.01 * least_percent * before.median:
        return "little"
    return "slower" if change > 0 else "faster"


def print_rows(title, pairs):
    if not pairs:
        return
    print(f"{title}: {len(pairs)}")
    for before, after in pairs:
        percent = 100.0 * (after.median / before.median - 1.0) if before.median else float("inf")
        noise = f"{noise_of(before, after):g}"
        if is_of_one_run(before, after):
            noise = "not known: one run"
        print(f"  {before.benchmark}  {before.quantity}  {before.median:g} -> {after.median:g} "
              f"{before.unit}  {percent:+.1f} %  (noise {noise})")


def print_missing(title, results, other):
    """What only `results` has, by benchmark; whether there is any."""
    missing, of_all = {}, {}
    for benchmark, quantity in results.rows:
        of_all[benchmark] = of_all.get(benchmark, 0) + 1
        if (benchmark, quantity) not in other.rows:
            missing.setdefault(benchmark, []).append(quantity)
    if missing:
        print(f"{title}: {sum(map(len, missing.values()))}")
    for benchmark, quantities in missing.items():
        is_whole = len(quantities) == of_all[benchmark]
        print(f"  {benchmark}  {'all ' if is_whole else ''}{', '.join(quantities)}")
    return bool(missing)


def compare(before, after, options):
    """Prints what differs; the exit status."""
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
    alone = sum(is_of_one_run(*pair) for pair in both)
    if alone:
        print(f"bench_compare.py: {alone} of {len(both)} numbers are of one run, whose noise is not "
              "known; measure several times", file=sys.stderr)
    lists = {"slower": [], "faster": [], "little": [], "same": []}
    for pair in both:
        lists[verdict(*pair, options.least)].append(pair)
    for pairs in lists.values():
        pairs.sort(key=lambda pair: pair[1].median / pair[0].median if pair[0].median else 0.0)
    print_rows("slower", lists["slower"][::-1])
    print_rows("faster", lists["faster"])
    least = f"{options.least:g} %, instructions {min(options.least, LEAST_OF_INSTRUCTIONS):g} %"
    by_little = f"beyond the noise, but by no more than --least ({least})"
    for title, pairs in ((by_little, lists["little"]), ("the same within the noise", lists["same"])):
        if options.all:
            print_rows(title, pairs)
        else:
            print(f"{title}: {len(pairs)}")
    lacks = print_missing("only before", before, after)
    print_missing("only after", after, before)
    return 1 if lists["slower"] else 4 if lacks else 0


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
        return compare(read_csv(options.before), read_csv(options.after), options)
    except BadInput as words:
        print(f"bench_compare.py: {words}", file=sys.stderr)
        return 3


if __name__ == "__main__":
    sys.exit(main())
