# SPDX-License-Identifier: Apache-2.0
"""Arrays of the program as a scene's data: voxels, labels and vectors, without a copy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from palpate import _palpate
from palpate._arguments import float64, require_unmasked, shown, text
from palpate.errors import ArgumentError

_FLOAT, _LABEL = np.dtype(np.float32), np.dtype(np.int32)


def _array(name: str, values: Any, wanted: np.dtype, axes: str) -> np.ndarray:
    """The array itself, where its memory is laid out as the library's is; else ArgumentError."""
    kind = f"np.{wanted.name}"
    if not isinstance(values, np.ndarray):
        raise ArgumentError(
            f"{name}: is of type {type(values).__name__}; give a numpy array: "
            f'np.asarray({name}, dtype={kind}, order="F")'
        )
    require_unmasked(name, values)
    if values.ndim != axes.count(",") + 1 or 0 in values.shape:
        raise ArgumentError(f"{name}: is of shape {values.shape}; give an array {axes}")
    if values.dtype != wanted:
        raise ArgumentError(
            f"{name}: is of type {values.dtype.str}; give {name}.astype({kind}, "
            'order="F"), which is a copy'
        )
    if values.flags.f_contiguous and not values.flags.aligned:
        raise ArgumentError(
            f"{name}: begins at an address that is no multiple of {wanted.itemsize} bytes, as "
            f'after a header in a file; give {name}.copy(order="F")'
        )
    if not values.flags.f_contiguous:
        raise ArgumentError(
            f"{name}: does not lie in memory with its first index fastest; give "
            f"np.asfortranarray({name}), which is a copy, or {name}.T where the order of its "
            "axes is the other way round"
        )
    return values


def _affine(name: str, affine: npt.ArrayLike) -> np.ndarray:
    """(4, 4) of float64, finite, its last row 0 0 0 1; a copy."""
    matrix = np.array(float64(name, affine))
    if matrix.shape != (4, 4):
        raise ArgumentError(
            f"{name}: is no matrix (4, 4) of numbers; give one that leads from i, j, k, 1 to "
            "x, y, z, 1"
        )
    if not np.isfinite(matrix).all():
        raise ArgumentError(f"{name}: has a number that is not finite; give the volume's place")
    if not np.array_equal(matrix[3], (0.0, 0.0, 0.0, 1.0)):
        raise ArgumentError(f"{name}: has the last row {matrix[3].tolist()}; give 0, 0, 0, 1")
    matrix.flags.writeable = False
    return matrix


def affine_from_ras_mm(affine: npt.ArrayLike) -> np.ndarray:
    """An ``index_to_scene`` from an affine in RAS and mm, as nibabel's ``image.affine`` is.

    ``affine``: (4, 4), voxel index to mm, x to the right, y to the front, z to the head. Returns
    (4, 4), voxel index to m, scene frame (LPS): x and y are turned round, and all is divided by
    1000. Raises ArgumentError where ``affine`` is no finite (4, 4).
    """
    to_scene = np.diag([-1e-3, -1e-3, 1e-3, 1.0])
    return to_scene @ _affine("affine", affine)


class VolumeData:
    """A volume in memory: `Voxels`, `Labels` or `Vectors`, for a scene's dict.

    Several scenes may share it. It keeps the arrays that it was made of, and so does each scene,
    loop and trace that it is felt in. Do not write to them meanwhile.
    """

    _native: _palpate.VolumeData
    _words: str

    def __reduce__(self) -> tuple[Any, ...]:
        """Of its arrays: to be copied, and to be sent to another process."""
        names = (self.names,) if isinstance(self, Labels) else ()
        return type(self), (self.values, self.index_to_scene, *names)

    @property
    def sha256(self) -> str:
        """The SHA-256 of size, place and content: a recording that needs it says the same."""
        return self._native.sha256

    def __repr__(self) -> str:
        return f"<palpate.{type(self).__name__}: {self._words}>"


def _words(kind: str, shape: Sequence[int]) -> str:
    return f"{kind}, " + " x ".join(str(count) for count in shape)


class Voxels(VolumeData):
    """A volume of numbers, as a CT: a surface is where they reach its ``iso_value``.

    ``values``: (I, J, K) of float32, own unit, indexed ``values[i, j, k]``, i fastest in memory
    (Fortran's order). It is not copied. NaN and infinite ones are taken for background.
    ``index_to_scene``: (4, 4), from i, j, k, 1 of a voxel's centre to x, y, z, 1 in m, scene frame
    (LPS); see `affine_from_ras_mm`. Raises ArgumentError that says what to give.
    """

    def __init__(self, values: np.ndarray, index_to_scene: npt.ArrayLike) -> None:
        self.values: np.ndarray = _array("values", values, _FLOAT, "(I, J, K)")
        self.index_to_scene: np.ndarray = _affine("index_to_scene", index_to_scene)
        self._words = _words("voxels", values.shape)
        self._native = _palpate.VolumeData.voxels(values, self.index_to_scene)


class Labels(VolumeData):
    """A volume of names, as a segmentation: a surface is the border of labels, ``label = "Liver"``.

    ``values``: (I, J, K) of int32, as `Voxels` has them, 0 for the background; or a list of such
    arrays of one shape, layers, where structures overlap. ``names``: of values, ``{7: "Liver"}``;
    with layers a list of such dicts, one for each. What has no name is called by its number.
    Several values may have one name, as in files: ``label`` then takes them as one surface.
    ``index_to_scene`` is that of `Voxels`. Raises ArgumentError that says what to give.
    """

    def __init__(
        self,
        values: np.ndarray | Sequence[np.ndarray],
        index_to_scene: npt.ArrayLike,
        names: Mapping[int, str] | Sequence[Mapping[int, str]] | None = None,
    ) -> None:
        if isinstance(values, (list, tuple)):
            layers = [
                _array(f"values[{i}]", layer, _LABEL, "(I, J, K)") for i, layer in enumerate(values)
            ]
            tables = [{}] * len(layers) if names is None else names
            if not layers or not isinstance(tables, (list, tuple)) or len(tables) != len(layers):
                raise ArgumentError(
                    f"names: is not one for each of {len(layers)} layers; give a list with a dict "
                    "for each"
                )
            if any(layer.shape != layers[0].shape for layer in layers):
                raise ArgumentError("values: has layers of several shapes; give them one shape")
        else:
            layers = [_array("values", values, _LABEL, "(I, J, K)")]
            tables = [{} if names is None else names]
        self.values: list[np.ndarray] = layers
        self.names: list[dict[int, str]] = [
            _names(f"names[{i}]" if len(tables) > 1 else "names", table)
            for i, table in enumerate(tables)
        ]
        self.index_to_scene: np.ndarray = _affine("index_to_scene", index_to_scene)
        self._words = _words("labels", layers[0].shape)
        self._native = _palpate.VolumeData.labels(layers, self.index_to_scene, self.names)


def _names(place: str, table: Any) -> dict[int, str]:
    if not isinstance(table, Mapping) and not callable(getattr(table, "items", None)):
        raise ArgumentError(
            f'{place} = {shown(table)}; give a dict of whole numbers and texts: {{7: "Liver"}}'
        )
    names: dict[int, str] = {}
    for value, name in table.items():
        array = float64(f"{place}: key", value)
        if array.shape != () or not -(2.0**31) <= array < 2.0**31 or array != np.floor(array):
            raise ArgumentError(
                f"{place}: key {shown(value)} is no value of a voxel; give a whole number in "
                "[-2147483648, 2147483647]"
            )
        if not isinstance(name, str) or not name:
            raise ArgumentError(
                f"{place}: key {shown(value)} has the name {shown(name)}; give a text, "
                'as {7: "Liver"}'
            )
        names[int(array)] = text(f"{place}: name", name, "a text")
    return names


class Vectors(VolumeData):
    """A volume of vectors, as a flow, or of symmetric tensors, as a diffusion: for effects.

    ``values``: (3, I, J, K) of float32, own unit, ``values[:, i, j, k]`` along the axes of the
    scene frame (LPS), the component fastest in memory, then i (Fortran's order). It is not copied.
    Tensors have six components: xx, xy, xz, yy, yz, zz. ``index_to_scene`` is that of `Voxels`.
    Raises ArgumentError that says what to give.
    """

    def __init__(self, values: np.ndarray, index_to_scene: npt.ArrayLike) -> None:
        self.values: np.ndarray = _array("values", values, _FLOAT, "(3, I, J, K)")
        if values.shape[0] not in (3, 6):
            raise ArgumentError(
                f"values: is of shape {values.shape}; give (3, I, J, K), or (6, I, J, K) of "
                "tensors; np.asfortranarray(np.moveaxis(values, -1, 0)) puts a last axis first"
            )
        self.index_to_scene: np.ndarray = _affine("index_to_scene", index_to_scene)
        self._words = _words("vectors" if values.shape[0] == 3 else "tensors", values.shape[1:])
        self._native = _palpate.VolumeData.vectors(values, self.index_to_scene)
