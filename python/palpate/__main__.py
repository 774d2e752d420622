# SPDX-License-Identifier: Apache-2.0
"""python3 -m palpate study_many UNITS: one unit, the table of all, or both."""

import argparse
import sys

from palpate.errors import Error
from palpate.many import _units, merge_studies, study_many, study_unit


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python3 -m palpate")
    commands = parser.add_subparsers(dest="command", required=True)
    many = commands.add_parser(
        "study_many",
        help="a study for each scan and structure",
        description="Does the units of a JSON file one after the other and writes their table.",
    )
    many.add_argument("units", metavar="UNITS", help="JSON: see palpate.study_many")
    part = many.add_mutually_exclusive_group()
    part.add_argument("--unit", type=int, metavar="N", help="does this one alone, from 0")
    part.add_argument("--merge", action="store_true", help="only writes the table")
    part.add_argument("--count", action="store_true", help="prints how many units there are")
    many.add_argument("--out", default="study_many", metavar="DIR", help="folder of the results")
    many.add_argument("--cache", metavar="DIR", help="folder for baked fields and meshes")
    return parser


def main() -> int:
    given = _parser().parse_args()
    try:
        if given.count:
            print(len(_units(given.units)))
        elif given.unit is not None:
            study_unit(given.units, given.unit, out=given.out, cache=given.cache)
        elif given.merge:
            merge_studies(given.units, out=given.out)
        else:
            study_many(given.units, out=given.out, cache=given.cache)
    except Error as error:
        print(f"palpate: {error}", file=sys.stderr)
        return 3
    return 0


if __name__ == "__main__":
    sys.exit(main())
