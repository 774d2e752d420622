# SPDX-License-Identifier: Apache-2.0
"""Columns of numbers that belong together."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate._arguments import shown

if TYPE_CHECKING:
    import pandas


class Table:
    """Named columns of one length, with what holds for all of them in ``attributes``.

    Like a DataFrame it is as long as its columns, and gives their names where it is iterated over.
    """

    columns: tuple[str, ...]
    """Names of the columns, in the order of the file that has the same; units are in the names."""
    attributes: dict[str, Any]
    """What holds for all rows: ``frame`` and units of positions, ``version`` of the engine."""

    def __getitem__(self, column: str) -> np.ndarray:
        """A column, (N,). Raises KeyError that names all there are."""
        if column not in self:
            raise KeyError(f"no column {shown(column)}; there are {', '.join(self.columns)}")
        return self._column(column)

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __contains__(self, column: object) -> bool:
        return isinstance(column, str) and column in self.columns

    def __len__(self) -> int:
        """The number of rows."""
        return len(self[self.columns[0]])

    def to_dataframe(self) -> pandas.DataFrame:
        """The columns as a pandas.DataFrame, copied; its ``attrs`` are the attributes."""
        import pandas

        frame = pandas.DataFrame({name: np.array(self[name]) for name in self.columns})
        frame.attrs.update(self.attributes)
        return frame

    def _column(self, column: str) -> np.ndarray:
        raise NotImplementedError
