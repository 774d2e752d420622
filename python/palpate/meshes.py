# SPDX-License-Identifier: Apache-2.0
"""Triangle meshes as arrays."""

from __future__ import annotations

import os
from typing import NamedTuple

import numpy as np

from palpate import _palpate


class Mesh(NamedTuple):
    """Vertices and triangles: ``V, F = mesh``."""

    vertices_m: np.ndarray
    """(V, 3) of float64, m, scene frame (LPS)."""
    triangles: np.ndarray
    """(F, 3) of uint32: rows of vertices_m, counter-clockwise seen from free space."""

    def faces(self) -> np.ndarray:
        """Triangles as pyvista.PolyData takes them: 3, a, b, c, 3, ..."""
        threes = np.full((len(self.triangles), 1), 3)
        return np.hstack([threes, self.triangles]).astype(np.int64).ravel()


def read_mesh(file: str | os.PathLike[str]) -> Mesh:
    """Reads a PLY, STL or OBJ; frame and unit are as the file says, else LPS and mm.

    Raises FileError.
    """
    arrays, _ = _palpate.read_mesh(os.fsencode(file))
    return Mesh(*arrays)
