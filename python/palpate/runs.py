# SPDX-License-Identifier: Apache-2.0
"""Traces: a scene felt along a path. Recordings: traces that were kept."""

from __future__ import annotations

import json
import os
import re
from contextlib import contextmanager
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from palpate import _palpate
from palpate._arguments import choice, file_name, integer, number, require_unmasked, text
from palpate.errors import ArgumentError
from palpate.scene import Scene, _extractor, _folder, native
from palpate.table import Table

if TYPE_CHECKING:
    import pandas

PathLike = str | os.PathLike[str]
Path = npt.ArrayLike | PathLike  # or a DataFrame

_ROW = ("t_s", "x_m", "y_m", "z_m")
_TIMING = ("spent_us", "estimate_us", "late_us", "surface_queries", "field_samples", "root_queries")
_SOFT = ("indentation_m", "stiffness_n_per_m", "front_x_m", "front_y_m", "front_z_m")
_BITS = ("surfaces_felt", "pressed_surface")  # as text: felt and pressed


class Frames(Table):
    """A row per frame. The arrays are views of what was computed: read them, or copy them.

    The columns are those of frames.csv, with its ``felt`` as text and as bits (surfaces_felt), and
    those of timing.csv behind them, and then those of frames.csv about soft surfaces, of every run.
    """

    columns = tuple(name for name in _palpate.column_names if name not in _TIMING + _SOFT + _BITS)
    columns += ("felt", "surfaces_felt") + _TIMING + _SOFT + ("pressed",)

    def __init__(self, frames: _palpate.Frames) -> None:
        self._native = frames
        self.attributes = {
            "frame": "LPS",
            "length": "m",
            "force": "N",
            "time": "s",
            "version": frames.version,
        }

    @property
    def probe_m(self) -> np.ndarray:
        """(N, 3), m, scene frame: the probe, as it was given."""
        return self._native.probe_m

    @property
    def proxy_m(self) -> np.ndarray:
        """(N, 3), m, scene frame: the proxy at each frame's end."""
        return self._native.proxy_m

    @property
    def force_n(self) -> np.ndarray:
        """(N, 3), N, scene frame: the force on the hand, after all limits."""
        return self._native.force_n

    @property
    def surfaces(self) -> list[str]:
        """Names of the surfaces that are felt; of a recording the first 64 of them."""
        return self._native.surfaces

    @property
    def touches(self) -> Touches:
        """What the frames touched, and how hard: a row per contact."""
        return Touches(self._native, self.attributes)

    def __len__(self) -> int:
        return len(self._native)

    def _column(self, column: str) -> np.ndarray:
        if column == "pressed":
            names = np.array([*self.surfaces, ""], dtype=np.str_)
            surface = self._native.column("pressed_surface")
            is_named = (self["indentation_m"] > 0) & (surface < len(self.surfaces))
            return names[np.where(is_named, surface, len(self.surfaces))]
        if column.startswith("front_"):  # where nothing is pressed in, it is the proxy
            is_pressed = self["indentation_m"] > 0
            front = np.where(is_pressed, self._native.column(column), self[f"proxy{column[5:]}"])
            front.setflags(write=False)
            return front
        if column != "felt":
            return self._native.column(column)
        indices, texts = self._native.felt()
        return np.array(texts, dtype=np.str_)[indices]


class Touches(Table):
    """A row per contact, frame by frame, and in a frame in the order of the surfaces.

    ``frame``: as in the column ``frame``. Where all frames were recorded it is the row, else
    ``np.searchsorted(recording["frame"], touches["frame"])`` is. ``surface``: its name, "" past
    the 64th of a recording. ``phase``: "began", "goes_on" or "ended" (once, without a force).
    ``point_x_m``, ``normal_x`` and ``force_x_n``, with y and z: scene frame; the normal is of
    length 1, out of the surface, and the force is what the surface puts on the proxy there. The
    numbers are views.
    """

    columns = ("frame", "surface", "phase")
    columns += tuple(f"point_{axis}_m" for axis in "xyz")
    columns += tuple(f"normal_{axis}" for axis in "xyz")
    columns += tuple(f"force_{axis}_n" for axis in "xyz")

    def __init__(self, frames: _palpate.Frames, attributes: dict[str, Any]) -> None:
        self._native = frames
        self.attributes = attributes

    @property
    def point_m(self) -> np.ndarray:
        """(N, 3), m, scene frame: of the contact's plane; of one that ended: the proxy before."""
        return self._native.touch_point_m()

    @property
    def normal(self) -> np.ndarray:
        """(N, 3), unit, scene frame: out of the surface, to the side of the proxy."""
        return self._native.touch_normal()

    @property
    def force_n(self) -> np.ndarray:
        """(N, 3), N, scene frame: on the proxy, along the normal and by friction across it."""
        return self._native.touch_force_n()

    def labels(self) -> np.ndarray:
        """(N,) of text: the label that each contact is with, "" where there is none.

        The first labelled voxel behind the contact, at most 3 mm deep: within a voxel of where two
        labels meet it may be the neighbour. Reads the scene's label files when it is first asked.
        Raises FileError where that fails, ArgumentError of a recording: replay it first.
        """
        if not isinstance(self._native, _palpate.TracedFrames):
            raise ArgumentError("labels: a recording has no voxels; replay it, and ask the trace")
        indices, texts = self._native.touched_labels()
        return np.array(texts, dtype=np.str_)[indices] if texts else np.empty(0, dtype=np.str_)

    def __len__(self) -> int:
        return len(self._native.touch_frame())

    def _column(self, column: str) -> np.ndarray:
        if column == "frame":
            return self._native.touch_frame()
        if column == "phase":
            return np.array(_palpate.phases)[self._native.touch_phase()]
        if column == "surface":
            names = [*self._native.surfaces, ""]
            return np.array(names)[np.minimum(self._native.touch_surface(), len(names) - 1)]
        quantity, axis = column.split("_")[:2]
        vectors = {"point": self.point_m, "normal": self.normal, "force": self.force_n}
        return vectors[quantity][:, "xyz".index(axis)]


class Source(NamedTuple):
    """What a recording was made from."""

    name: str
    """A file, a surface's field or mesh, or data in memory: 'volumes["ct"].voxels, 9 x 9 x 9'."""
    sha256: str
    """Of its content, hexadecimal; of data in memory as `Voxels.sha256`."""


class Trace(Frames):
    """What `trace` and `replay` give."""

    _native: _palpate.TracedFrames

    def summary(self) -> dict[str, Any]:
        """What the command writes as summary.json: errors, certificates, what each surface felt."""
        return json.loads(self._native.summary())

    def save(self, file: PathLike, *, force: bool = False) -> None:
        """Writes recording.h5: `read_recording` and `palpate replay` read it.

        Raises FileError where that cannot be written, is an input of the scene, or, without
        ``force``, is a file that Palpate did not write.
        """
        self._native.save(file_name("file", file), choice("force", force))


class Recording(Frames):
    """What `read_recording` gives."""

    _native: _palpate.RecordedFrames

    @property
    def scene_text(self) -> str:
        """The scene that it was made with, TOML; "" where it had data in memory."""
        return self._native.scene_text

    @property
    def hand(self) -> str:
        """The hand of several whose run this is; "" where the recording has one without a name."""
        return self._native.hand

    @property
    def scene_file(self) -> str:
        """Where that was read from; it anchors its relative paths."""
        return self._native.scene_file

    @property
    def sources(self) -> list[Source]:
        """What it needs to be replayed: files, fields, meshes, data in memory, by their hash."""
        return [Source(*source) for source in self._native.sources]


def _rows(path: Any, rate_hz: float) -> np.ndarray:
    """A path in memory as rows of t_s, x_m, y_m, z_m."""
    if hasattr(path, "columns") and hasattr(path, "to_numpy"):
        missing = [name for name in _ROW if name not in path.columns]
        if missing:
            raise ArgumentError(
                f"path: has no column {missing[0]}; give columns {', '.join(_ROW)}"
            )
        path = path[list(_ROW)].to_numpy()
    require_unmasked("path", path)
    try:
        rows = np.asarray(path)
    except ValueError:
        rows = np.empty(0, dtype=object)
    if rows.dtype.kind not in "fiu" or rows.ndim != 2 or rows.shape[1] not in (3, 4):
        raise ArgumentError(
            f"path: is of shape {rows.shape} and type {rows.dtype}; give positions (N, 3) in m, "
            f"rows (N, 4) of {', '.join(_ROW)}, a DataFrame with these columns, or a file's name"
        )
    rows = rows.astype(np.float64, copy=False)
    if rows.shape[1] == 4:
        return rows
    return np.column_stack([np.arange(len(rows)) / rate_hz, rows])


def _source(scene: Scene, path: Any, rate_hz: float | None) -> Any:
    if rate_hz is not None:
        rate_hz = number("rate_hz", rate_hz, "a finite number > 0, Hz, or None")
        if not (np.isfinite(rate_hz) and rate_hz > 0):
            raise ArgumentError(
                f"rate_hz = {rate_hz} is out of range; give a finite number > 0, Hz"
            )
    if path is None or isinstance(path, (str, os.PathLike)):
        if rate_hz is not None:
            raise ArgumentError("rate_hz: goes with an array of positions; leave it out")
        return None if path is None else file_name("path", path)
    rows = _rows(path, scene.rate_hz if rate_hz is None else rate_hz)
    if rate_hz is not None and np.shape(path)[1] != 3:
        raise ArgumentError(
            "rate_hz: goes with an array of positions; rows have their t_s; leave it out"
        )
    return rows


def _options(method: Any, sub_steps: Any, tolerance_um: Any, budget_us: Any) -> tuple[Any, ...]:
    """What changes a run, of its types; the library says what its range is."""
    most = _palpate.most_sub_steps
    return (
        None if method is None else text("method", method, 'the name of one, as "adaptive"'),
        None if sub_steps is None else integer("sub_steps", sub_steps, 1, most),
        None if tolerance_um is None else number("tolerance_um", tolerance_um, "a number or None"),
        None if budget_us is None else number("budget_us", budget_us, "a number or None"),
    )


@contextmanager
def _options_as_arguments() -> Iterator[None]:
    """The library calls what changes a run as the command does: --sub-steps."""
    try:
        yield
    except ArgumentError as error:
        line = re.sub(r"--([a-z]+(?:-[a-z]+)*)", lambda m: m[1].replace("-", "_"), str(error))
        raise ArgumentError(line) from None


def trace(
    scene: Scene,
    path: Path | pandas.DataFrame | None = None,
    *,
    rate_hz: float | None = None,
    every: int = 1,
    method: str | None = None,
    sub_steps: int | None = None,
    tolerance_um: float | None = None,
    budget_us: float | None = None,
) -> Trace:
    """Feels a scene along a path, a frame per row: the frames of `palpate trace`, bit for bit.

    ``path``: positions (N, 3), m, scene frame, a period apart; rows (N, 4) of t_s, x_m, y_m, z_m,
    where t_s = 0 begins a new trial; a DataFrame with these columns; the name of a CSV file of
    them; None: the scene's own path, orbit, tour or recording, and of a scene with several hands
    that of one of them (`Scene.of_hand`). ``rate_hz``: of positions (N, 3),
    Hz; None: the scene's own. It has to be the scene's within 1 %: rows are frames. ``every`` = K
    takes each K-th row of a trial. The others are as in the scene's [loop], for this run.

    Other threads of Python run meanwhile. Ctrl-C ends it; what was computed is thrown away.
    Raises ArgumentError for what is wrong with an argument, SceneError where the scene has no path
    of its own, FileError where a file cannot be read.
    """
    felt = native(scene)
    source, step = _source(scene, path, rate_hz), integer("every", every, 1)
    options = _options(method, sub_steps, tolerance_um, budget_us)
    with _options_as_arguments():
        return Trace(_palpate.trace(felt, source, step, *options))


def read_recording(file: PathLike, hand: str | None = None) -> Recording:
    """Reads recording.h5 of a trace, or what was kept of a run that was cut off.

    ``hand``: of several hands whose run it is, by its name (`recorded_hands`); None: there is one.
    Raises FileError, also where there are several and none is named.
    """
    name = "" if hand is None else text("hand", hand, 'the name of one, as "left"')
    return Recording(_palpate.read_recording(file_name("file", file), name))


def recorded_hands(file: PathLike) -> list[str]:
    """Names of the hands that a recording has; an empty list where it has one without a name.

    Raises FileError.
    """
    return _palpate.recorded_hands(file_name("file", file))


def replay(
    recording: Recording | PathLike,
    scene: Scene | None = None,
    *,
    cache: PathLike | None = None,
    extraction: bool | None = None,
) -> Trace:
    """Computes a recording's frames again, bit for bit but for the columns of timing.csv.

    ``scene``: the scene that it was made with, where that has data in memory: a recording keeps
    their hashes alone. The same data lead to the same frames, wherever they lie now. Coupling,
    limits and settings of effects are not compared. ``cache`` and ``extraction`` are those of
    `Scene`; ``extraction`` None: as ``scene`` was made. Raises FileError that says what has
    changed since it was recorded, or why it cannot be replayed; ArgumentError where ``scene`` is
    missing.
    """
    if not isinstance(recording, Recording):
        remedy = "a palpate.Recording or a file's name"
        recording = read_recording(os.fsdecode(file_name("recording", recording, remedy)))
    if scene is None and not recording.scene_text:
        raise ArgumentError(
            "scene: is None, and the recording is of data in memory, which it does not keep; give "
            "the palpate.Scene that it was made with"
        )
    made_of = None if scene is None else native(scene)
    if scene is not None and extraction is None:
        extraction = scene._extraction
    return Trace(
        _palpate.replay(recording._native, made_of, _folder(cache), _extractor(extraction))
    )
