# SPDX-License-Identifier: Apache-2.0
"""What users give, as the library takes it; what cannot be taken is named, with what to give."""

from __future__ import annotations

import numbers
import operator
import os
from typing import Any

import numpy as np

from palpate.errors import ArgumentError, FileError

_LONGEST = 80  # characters of a value in a message
_MOST_INTEGER = 2**31 - 1  # of an int in C++


def shown(value: Any) -> str:
    """A value in a message: one line, and not too long."""
    line = " ".join(repr(value).split())
    return line if len(line) <= _LONGEST else f"{line[:_LONGEST]}..."


def wrong_type(name: str, value: Any, remedy: str) -> TypeError:
    return TypeError(f"{name} = {shown(value)} is of type {type(value).__name__}; give {remedy}")


def require_unmasked(name: str, values: Any) -> None:
    """What lies below the mask of a masked array are no numbers, but would be read as such."""
    if isinstance(values, np.ma.MaskedArray):
        raise ArgumentError(
            f"{name}: is masked; give {name}.filled(value) with a value for what is masked"
        )


def float64(name: str, values: Any) -> np.ndarray:
    """Values as an array of float64; (0,) where they are no real numbers, as texts are none."""
    require_unmasked(name, values)
    try:
        array = np.asarray(values)
        kind = array.dtype.kind
        if kind in "fiu" or (
            kind == "O" and all(isinstance(value, numbers.Real) for value in array.flat)
        ):
            return array.astype(np.float64, copy=False)
    except (TypeError, ValueError, OverflowError):
        pass
    return np.empty(0)


def point_rows(name: str, values: Any) -> np.ndarray:
    """Places, (N, 3), m, finite or not."""
    rows = float64(name, values)
    if rows.ndim != 2 or rows.shape[1] != 3:
        raise ArgumentError(
            f"{name} = {shown(values)}: are no rows of three numbers; give (N, 3) in m"
        )
    return rows


def vector(name: str, values: Any, count: int, remedy: str) -> list[float]:
    """``count`` numbers, finite or not."""
    array = float64(name, values)
    if array.shape != (count,):
        raise ArgumentError(f"{name} = {shown(values)}; give {remedy}")
    return array.tolist()


def number(name: str, value: Any, remedy: str) -> float:
    """A number, finite or not; True is 1, as in the gain of what is on."""
    if isinstance(value, (bool, np.bool_)):
        return float(value)
    array = float64(name, value)
    if array.shape != ():
        raise wrong_type(name, value, remedy)
    return float(array)


def integer(name: str, value: Any, least: int, most: int = _MOST_INTEGER) -> int:
    """An integer in [least, most]."""
    remedy = f"an integer in [{least}, {most}]"
    try:
        index = operator.index(value)
    except TypeError:
        raise wrong_type(name, value, remedy) from None
    if not least <= index <= most:
        raise ArgumentError(f"{name} = {shown(value)} is out of range; give {remedy}")
    return index


def choice(name: str, value: Any) -> bool:
    """True or False; anything else, as "no", is a mistake, even where Python takes it for true."""
    is_boolean_array = isinstance(value, np.ndarray) and value.shape == () and value.dtype == bool
    if not isinstance(value, (bool, np.bool_)) and not is_boolean_array:
        raise wrong_type(name, value, "True or False")
    return bool(value)


def text(name: str, value: Any, remedy: str) -> str:
    """A text that the library can read: UTF-8, and not cut short by a NUL."""
    if not isinstance(value, str):
        raise wrong_type(name, value, remedy)
    try:
        is_whole = b"\0" not in value.encode()
    except UnicodeEncodeError:
        is_whole = False
    if not is_whole:
        raise ArgumentError(f"{name} = {shown(value)} has a character that is none; give {remedy}")
    return value


def file_name(name: str, file: Any, remedy: str = "a file's name") -> bytes:
    try:
        encoded = os.fsencode(file)
    except TypeError:
        raise wrong_type(name, file, remedy) from None
    except UnicodeEncodeError:
        encoded = b"\0"
    if b"\0" in encoded:
        raise FileError(f"{name} = {shown(file)} has a character that is none; give {remedy}")
    return encoded
