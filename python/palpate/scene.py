# SPDX-License-Identifier: Apache-2.0
"""Scenes: from a file, from TOML text, from a dict."""

from __future__ import annotations

import importlib.util
import json
import os
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np
import numpy.typing as npt

from palpate import _palpate, _toml
from palpate._arguments import choice, file_name, integer, point_rows, shown
from palpate._arguments import text as _text
from palpate.data import VolumeData
from palpate.errors import FileError, SceneError
from palpate.meshes import Mesh, _arrays


def usual_cache_folder() -> str:
    """Where the command keeps baked fields and meshes; "" where it keeps none."""
    return _palpate.usual_cache_folder()


def _extractor(extraction: bool | None) -> Any:
    """What makes meshes of volumes, where it is wanted and there; it is under the GPL."""
    if extraction is not None and not choice("extraction", extraction):
        return None
    try:
        from palpate import _extraction
    except ImportError as error:
        if importlib.util.find_spec("palpate._extraction") is not None:
            raise SceneError(
                f"extraction: palpate._extraction is there and cannot be loaded ({error}); "
                "install what it needs, or give extraction=False"
            ) from error
        if extraction:
            raise SceneError(
                "extraction = True: this build of the package has none; "
                "build it with CGAL, or leave it out"
            ) from error
        return None
    return _extraction.extractor


def _folder(cache: str | os.PathLike[str] | None) -> bytes:
    return b"" if cache is None else file_name("cache", cache, "a folder's name or None")


@contextmanager
def _anchored(file: bytes) -> Iterator[bytes]:
    """A scene's file, wherever the working folder goes later; errors name it as it was given."""
    if not file or os.path.isabs(file):
        yield file
        return
    try:
        here = os.getcwdb()
    except OSError:  # it was removed: nothing lies beside the scene
        here = b""
    whole = os.path.join(here, file)
    try:
        yield whole
    except (SceneError, FileError) as error:
        raise type(error)(str(error).replace(os.fsdecode(whole), os.fsdecode(file))) from None


def _table(tables: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    table = tables.get(key)
    return table if isinstance(table, Mapping) else {}


def _require_wrapped(source: Mapping[str, Any]) -> None:
    """Refuses arrays as they are, which would become text that the reader cannot make sense of."""

    def require(place: str, value: Any, kinds: tuple[type, ...], remedy: str) -> None:
        if not isinstance(value, kinds):
            raise SceneError(f"dict: {place} is of type {type(value).__name__}; give {remedy}")

    memory = "palpate.Voxels(array, index_to_scene), Labels or Vectors"
    for name, table in _table(source, "volume").items():
        place = f"volume.{name}"
        require(place, table, (Mapping, VolumeData), f"a dict, or {memory}")
        if isinstance(table, Mapping) and "file" in table:
            remedy = f"its name, or {memory} as {place}"
            require(f"{place}.file", table["file"], (str, os.PathLike), remedy)
    for name, table in _table(source, "surface").items():
        if isinstance(table, Mapping) and "mesh" in table:
            remedy = "a file's name, or palpate.Mesh(vertices_m, triangles)"
            require(f"surface.{name}.mesh", table["mesh"], (str, os.PathLike, Mesh), remedy)


def _split(
    source: Mapping[str, Any],
) -> tuple[dict[str, Any], dict[str, VolumeData], dict[str, Mesh]]:
    """A scene's tables without what is in memory, and that by the names of its tables."""
    tables = dict(source)
    _require_wrapped(source)
    volumes = {
        name: data
        for name, data in _table(source, "volume").items()
        if isinstance(data, VolumeData)
    }
    meshes = {
        name: table["mesh"]
        for name, table in _table(source, "surface").items()
        if isinstance(table, Mapping) and isinstance(table.get("mesh"), Mesh)
    }
    if volumes:
        tables["volume"] = dict(source["volume"])
        for name, data in volumes.items():
            tables["volume"][name] = _toml.Noted({}, f"{data._words}, in memory")
    if meshes:
        tables["surface"] = dict(source["surface"])
        for name in meshes:
            table = {key: part for key, part in source["surface"][name].items() if key != "mesh"}
            tables["surface"][name] = _toml.Noted(table, "its mesh is in memory")
    return tables, volumes, meshes


def native(scene: Any) -> _palpate.Scene:
    """What C++ has of a scene; who gives something else is told."""
    if not isinstance(scene, Scene):
        raise TypeError(f"scene is of type {type(scene).__name__}; give a palpate.Scene")
    return scene._native


class Scene:
    """What can be felt: loaded once, it never changes. Loops and traces may share it.

    ``source`` is a scene file (TOML), or a dict with the tables and keys of such a file; files
    that a dict names are relative to the working folder. See `from_text` for TOML text. In a dict
    a volume may be a `Voxels`, `Labels` or `Vectors` instead of a table, and the ``mesh`` of a
    surface a `Mesh`: data in memory. Arrays of volumes are not copied and live as long as the
    scene; do not write to them meanwhile. Those of meshes are copied.

    ``cache`` is a folder for baked fields and extracted meshes; None keeps nothing, and
    ``palpate.usual_cache_folder()`` shares the command's. ``extraction`` says whether volumes may
    be made meshes of, with CGAL under the GPL (palpate._extraction): True, False, or None, where
    that module is installed.

    Raises SceneError for what is wrong with the scene or a file that it names, FileError where the
    scene file cannot be read. Ctrl-C ends loading.
    """

    def __init__(
        self,
        source: str | os.PathLike[str] | Mapping[str, Any],
        *,
        cache: str | os.PathLike[str] | None = None,
        extraction: bool | None = None,
    ) -> None:
        folder, extractor = _folder(cache), _extractor(extraction)
        self._extraction = extraction
        if isinstance(source, Mapping):
            tables, self._volumes, self._meshes = _split(source)
            text = _toml.scene_text(tables)
            volumes = {name: data._native for name, data in self._volumes.items()}
            meshes = {
                name: _arrays(mesh, f'surface["{name}"]') for name, mesh in self._meshes.items()
            }
            try:
                with _anchored(b"dict") as file:
                    self._native = _palpate.Scene.from_text(
                        text, file, folder, extractor, volumes, meshes
                    )
            except SceneError as error:
                raise SceneError(_toml.without_lines(str(error), text)) from None
        elif isinstance(source, (str, os.PathLike)):
            self._volumes, self._meshes = {}, {}
            with _anchored(file_name("source", source)) as file:
                self._native = _palpate.Scene.from_file(file, folder, extractor)
        else:
            raise TypeError(
                f"source is of type {type(source).__name__}; give a file's name or a dict"
            )

    @classmethod
    def from_text(
        cls,
        text: str,
        *,
        file: str | os.PathLike[str] = "text",
        cache: str | os.PathLike[str] | None = None,
        extraction: bool | None = None,
    ) -> Scene:
        """A scene from TOML text; ``file`` names it in messages and anchors relative paths.

        Raises SceneError.
        """
        toml = _text("text", text, "the TOML of a scene")
        scene = cls.__new__(cls)
        scene._volumes, scene._meshes, scene._extraction = {}, {}, extraction
        with _anchored(file_name("file", file)) as name:
            scene._native = _palpate.Scene.from_text(
                toml, name, _folder(cache), _extractor(extraction), {}, {}
            )
        return scene

    @property
    def name(self) -> str:
        """The file's name without its ending; "dict" or "text" where there is no file."""
        return self._native.file.stem

    @property
    def text(self) -> str:
        """The scene as TOML; of a dict, what was made of it. Data in memory are comments in it."""
        return self._native.text

    @property
    def description(self) -> dict[str, Any]:
        """The scene's tables as a fresh dict: as its file says them, without default values.

        Data in memory are in it as they were given.
        """
        tables = tomllib.loads(self.text.removeprefix("\ufeff"))  # a byte-order mark
        tables.get("volume", {}).update(self._volumes)
        for name, mesh in self._meshes.items():
            tables["surface"][name]["mesh"] = mesh
        return tables

    @property
    def rate_hz(self) -> float:
        """Frames per second, Hz."""
        return self._native.rate_hz

    @property
    def method(self) -> str:
        """How the proxy is moved: "single", "paper", "fixed" or "adaptive"."""
        return self._native.method

    @property
    def surfaces(self) -> list[str]:
        """Names of the surfaces that are felt."""
        return self._native.surfaces

    @property
    def effects(self) -> list[str]:
        """Kinds of its effects, in the order in which `Loop.set_gain` counts them."""
        return self._native.effects

    @property
    def hands(self) -> list[str]:
        """Names of its hands, where it has several; else an empty list."""
        return self._native.hands

    def of_hand(self, name: str) -> Scene:
        """The same scene as one of its hands has it alone: `trace` takes that hand's device.

        All data are shared. Raises ArgumentError that says which hands there are.
        """
        scene = type(self).__new__(type(self))
        scene._volumes, scene._meshes = self._volumes, self._meshes
        scene._extraction = self._extraction
        scene._native = self._native.of_hand(_text("name", name, 'that of a hand, as "left"'))
        return scene

    @property
    def warnings(self) -> list[str]:
        """What will not be felt as it is meant, a line each: what the command prints on stderr."""
        return self._native.warnings

    def explain(self) -> str:
        """What it computes, what it leaves out, and why: as `palpate explain` prints it.

        Measures what each effect costs on this machine, which takes a moment.
        """
        return self._native.in_words(False)

    def plan(self) -> dict[str, Any]:
        """The same as a dict: as `palpate explain --json` prints it."""
        return json.loads(self._native.in_words(True))

    def mesh(self, surface: str) -> Mesh | None:
        """The mesh of a surface that is felt, or None where its contact needs none.

        Raises KeyError where no such surface is felt.
        """
        self._require_felt(surface)
        arrays = self._native.mesh(surface)
        return None if arrays is None else Mesh(*arrays)

    def stiffness(self, surface: str, points: npt.ArrayLike) -> np.ndarray:
        """The stiffness that the hand feels of a surface at places of it: (N,), N/m.

        ``points`` are (N, 3), m, scene frame, and on the surface. It is that where pressing begins,
        with what lies ``beneath``; of a hard surface the coupling's. Raises KeyError where no such
        surface is felt, and ArgumentError where ``points`` is no (N, 3).
        """
        self._require_felt(surface)
        return self._native.stiffness(surface, point_rows("points", points))

    def path(self, *, every: int = 1) -> np.ndarray:
        """The probe path of the scene's own device: (N, 4) of t_s, x_m, y_m, z_m, as in a file.

        Of a path, an orbit, a tour or a recording; ``every`` = K takes each K-th row of a path, or
        goes around an orbit K times as fast. Raises SceneError where the device is another one,
        ArgumentError where ``every`` > 1 goes with no other. Warns where a generated path ends
        before it was everywhere.
        """
        return self._native.path(integer("every", every, 1))

    def _require_felt(self, surface: Any) -> None:
        if not isinstance(surface, str) or surface not in self.surfaces:
            felt = ", ".join(self.surfaces) or "none"
            raise KeyError(f"no surface {shown(surface)} is felt; there are {felt}")

    def __repr__(self) -> str:
        return f"<palpate.Scene {self.name}: {', '.join(self.surfaces) or 'no surface'}>"
