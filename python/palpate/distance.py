# SPDX-License-Identifier: Apache-2.0
"""Distances from surfaces, for planning and display."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from palpate import _palpate
from palpate._arguments import point_rows, text
from palpate.scene import Scene, native


class Nearest(NamedTuple):
    """Nearest points of a surface, one for each of N points; NaN where none was found."""

    position_m: np.ndarray
    """(N, 3), m, scene frame: on the surface."""
    normal: np.ndarray
    """(N, 3), unit, scene frame: out of the surface."""
    distance_m: np.ndarray
    """(N,), m: from the point to the surface; < 0 where the point is behind it."""
    sign_known: np.ndarray
    """(N,) of bool: False where the mesh has a border, and so no inside."""


class SurfaceDistance:
    """Distances from one surface of a scene, as the scene names it: no texture, nothing yielded.

    Exact for a surface of a mesh alone. Of a volume the nearest point is on the level as
    interpolated, to 1e-11 m, and the nearest that several ways lead to. ``surface`` is one of
    `Scene.surfaces`; else ArgumentError.
    """

    def __init__(self, scene: Scene, surface: str) -> None:
        name = text("surface", surface, "the name of one that is felt")
        self._native = _palpate.SurfaceDistance(native(scene), name)

    def nearest(self, points: npt.ArrayLike) -> Nearest:
        """The nearest point for each of ``points``, (N, 3), m, scene frame.

        NaN where the point is not finite, or nothing is found within 1 m. Other threads of Python
        run meanwhile, and Ctrl-C ends it. Raises ArgumentError where ``points`` is no (N, 3).
        """
        return Nearest(*self._native.nearest(point_rows("points", points)))
