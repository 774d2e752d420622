# SPDX-License-Identifier: Apache-2.0
"""Reads paths and answers, and says what is wrong with them: file, line, value, what to do."""

import math

import numpy as np

PATH_COLUMNS = "t_s,x_m,y_m,z_m"
ANSWER_COLUMNS = "t_s,proxy_x_m,proxy_y_m,proxy_z_m,force_x_n,force_y_n,force_z_n,ns,reference_ns"


class BadInput(Exception):
    """One line: FILE[:LINE]: what is wrong; what to do."""


def read_rows(file, columns):
    """The numbers of a CSV file with this header, (rows, columns)."""
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(f"{file}: cannot be read ({error}); give a text file") from error
    if not lines or lines[0].strip() != columns:
        first = lines[0] if lines else ""
        raise BadInput(f'{file}:1: the header is "{first[:120]}"; write exactly "{columns}"')
    names = columns.split(",")
    rows = np.empty((len(lines) - 1, len(names)))
    for number, line in enumerate(lines[1:], start=2):
        cells = line.split(",")
        if len(cells) != len(names):
            raise BadInput(f"{file}:{number}: {len(cells)} values; write {len(names)}: {columns}")
        for column, (name, cell) in enumerate(zip(names, cells)):
            rows[number - 2, column] = _number(cell, f"{file}:{number}: {name}")
    return rows


def _number(cell, where):
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise BadInput(f'{where} = "{cell.strip()}" is no finite number; write one, such as 0.001')
    return value


def read_path(folder):
    """Times (n,) and probes (n, 3) of a track."""
    rows = read_rows(folder / "path.csv", PATH_COLUMNS)
    return rows[:, 0], rows[:, 1:]


class Answer:
    """An entrant's rows to a track."""

    def __init__(self, file, times):
        rows = read_rows(file, ANSWER_COLUMNS)
        if len(rows) != len(times):
            raise BadInput(f"{file}: {len(rows)} rows, but the path has {len(times)}; write one "
                           "row for each row of path.csv, in its order")  # fmt: skip
        for number, (own, given) in enumerate(zip(rows[:, 0], times), start=2):
            if abs(own - given) > 1e-6:
                raise BadInput(f"{file}:{number}: t_s = {own:g}, but the path has {given:g}; "
                               "write the rows in the order of path.csv")  # fmt: skip
        for column, name, least in ((7, "ns", 0), (8, "reference_ns", 1)):
            wrong = np.flatnonzero(rows[:, column] < least)
            if len(wrong):
                value = rows[wrong[0], column]
                raise BadInput(f"{file}:{wrong[0] + 2}: {name} = {value:g} is below {least}; "
                               "write the measured time in ns")  # fmt: skip
        self.proxies, self.forces = rows[:, 1:4], rows[:, 4:7]
        self.ns, self.reference_ns = rows[:, 7], rows[:, 8]
