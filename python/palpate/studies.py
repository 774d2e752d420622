# SPDX-License-Identifier: Apache-2.0
"""Accuracy against time."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING

import numpy as np

from palpate import _palpate
from palpate._arguments import choice, integer
from palpate.runs import Path, _source
from palpate.scene import Scene, native
from palpate.table import Table

if TYPE_CHECKING:
    import pandas

_TEXT = ("scan", "structure", "method", "pace", "note")


class Study(Table):
    """A row per method and setting, with the columns of study.csv; what is not known is NaN."""

    text: str
    """The same as CSV, as study.csv has it."""

    def __init__(self, text: str) -> None:
        self.text = text
        header, *rows = csv.reader(io.StringIO(text))
        self.columns = tuple(header)
        self._columns = {
            name: np.array(cells, dtype=np.str_)
            if name in _TEXT
            else np.array([float(cell) if cell else np.nan for cell in cells])
            for name, cells in zip(header, zip(*rows))
        }
        self.attributes = {"frame": "LPS", "version": _palpate.version}

    def _column(self, column: str) -> np.ndarray:
        return self._columns[column]


def study(
    scene: Scene,
    path: Path | pandas.DataFrame | None = None,
    *,
    rate_hz: float | None = None,
    every: int = 1,
    baselines: bool = True,
) -> Study:
    """Feels a scene along a path with every method over its range, back to back.

    The same as `palpate study`: how long a frame took (``spent_p50_us``) and how far the proxy was
    from the surface (``level_rms_um``). ``path``, ``rate_hz`` and ``every`` are those of `trace`.
    ``baselines`` adds methods up to the paper's own. Takes seconds to minutes; other threads run
    meanwhile, and Ctrl-C ends it. Raises as `trace`, and SceneError where nothing is felt.
    """
    felt = native(scene)
    source, step = _source(scene, path, rate_hz), integer("every", every, 1)
    return Study(_palpate.study(felt, source, step, choice("baselines", baselines)))
