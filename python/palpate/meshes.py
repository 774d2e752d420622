# SPDX-License-Identifier: Apache-2.0
"""Triangle meshes as arrays."""

from __future__ import annotations

import os
from typing import NamedTuple

import numpy as np

from palpate import _palpate
from palpate._arguments import file_name, require_unmasked
from palpate.errors import ArgumentError


class Mesh(NamedTuple):
    """Vertices and triangles: ``V, F = mesh``. As ``mesh`` of a surface in a scene's dict: felt."""

    vertices_m: np.ndarray
    """(V, 3) of float64, m, scene frame (LPS)."""
    triangles: np.ndarray
    """(F, 3) of uint32: rows of vertices_m, counter-clockwise seen from free space."""

    def faces(self) -> np.ndarray:
        """Triangles as pyvista.PolyData takes them: 3, a, b, c, 3, ..."""
        threes = np.full((len(self.triangles), 1), 3)
        return np.hstack([threes, self.triangles]).astype(np.int64).ravel()


def _arrays(mesh: Mesh, place: str) -> tuple[np.ndarray, np.ndarray]:
    """A mesh's arrays as C++ takes them; ArgumentError where they are of another kind."""
    for name, wanted in (("vertices_m", np.float64), ("triangles", np.uint32)):
        array = getattr(mesh, name)
        require_unmasked(name, array)
        given = f"{place}: {name} is"
        if not isinstance(array, np.ndarray) or array.ndim != 2 or array.shape[1] != 3:
            shape = np.shape(array) if isinstance(array, np.ndarray) else type(array).__name__
            raise ArgumentError(f"{given} {shape}; give an array (N, 3)")
        if array.dtype != wanted:
            raise ArgumentError(
                f"{given} of type {array.dtype.str}; give {name}.astype(np.{wanted.__name__})"
            )
        if not array.flags.c_contiguous:
            raise ArgumentError(
                f"{given} not in memory row by row; give np.ascontiguousarray({name})"
            )
    return tuple(mesh)


def read_mesh(file: str | os.PathLike[str]) -> Mesh:
    """Reads a PLY, STL, OBJ, .vtp or .vtk; frame and unit are as the file says, else LPS and mm.

    Raises FileError.
    """
    arrays, _ = _palpate.read_mesh(file_name("file", file))
    return Mesh(*arrays)
