# SPDX-License-Identifier: Apache-2.0
"""Many studies: a unit per scan and structure, each with a file of its own."""

from __future__ import annotations

import csv
import functools
import hashlib
import io
import json
import os
import re
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any


from palpate import _palpate, _toml
from palpate._arguments import file_name, integer
from palpate.errors import ArgumentError, Error, FileError, SceneError
from palpate.runs import PathLike
from palpate.scene import Scene, _extractor
from palpate.studies import Study, study

if TYPE_CHECKING:
    import distributed

_KEYS = {"scan", "structure", "scene", "path", "every", "baselines"}
_TABLE, _TIMING = "study_many.csv", "study_many_timing.csv"
_BY_THE_CLOCK = ("spent_", "late_", "over_")  # columns
_READS_THE_CLOCK = "paper"  # the method
_MARK = "palpate_study"  # in the file of a unit: the version that wrote it
_TOLD = 3  # failed units in a message

_Unit = dict[str, Any]


class Studies(Study):
    """What `study_many` gives: the rows of `study` of all units, without what a clock decides.

    ``scan`` and ``structure`` come before the columns of `study`. Rows of method "paper", which
    reads the clock, and columns of microseconds are in ``timing`` alone: so the same units give
    the same bits, whoever computed them.
    """

    timing: Study
    """All rows with all columns of `study`, as they came out on the computers that ran them."""


# Units


def _unit(given: Any, i: int, folder: Path) -> _Unit:
    """A unit as workers take it: plain, with absolute names of files."""
    place = f"units[{i}]"

    def refuse(what: str, remedy: str) -> ArgumentError:
        return ArgumentError(f"{place}: {what}; {remedy}")

    if not isinstance(given, Mapping):
        raise refuse(f"is of type {type(given).__name__}", "give a dict")
    for key in given:
        if key not in _KEYS:
            raise refuse(f"unknown key {key!r}", f"known are {', '.join(sorted(_KEYS))}")
    for key in ("scan", "structure"):
        if not isinstance(given.get(key), str) or not given[key].isprintable() or not given[key]:
            raise refuse(f"{key} = {given.get(key)!r} is no name", "give a text of one line")
    scene = given.get("scene")
    every, baselines = given.get("every", 1), given.get("baselines", True)
    if isinstance(every, bool):
        raise refuse(f"every = {every!r} is no number", "give an integer")
    try:
        every = integer(f"{place}: every", every, 1)
    except TypeError as error:
        raise ArgumentError(str(error)) from None
    if not isinstance(baselines, bool):
        raise refuse(f"baselines = {baselines!r} is no choice", "give True or False")
    unit: _Unit = {"scan": given["scan"], "structure": given["structure"]}
    unit.update(every=every, baselines=baselines, path=None)
    if isinstance(scene, Mapping):
        try:
            unit.update(scene=_toml.scene_text(scene), file=str(folder / "dict"))
        except (SceneError, TypeError) as error:
            raise ArgumentError(f"{place}: {error}") from None
    elif isinstance(scene, (str, os.PathLike)):
        unit.update(scene=None, file=str(folder / _name(f"{place}: scene", scene)))
    else:
        raise refuse(f"scene is of type {type(scene).__name__}", "give a file's name or a dict")
    if given.get("path") is not None:
        if not isinstance(given["path"], (str, os.PathLike)):
            raise refuse(
                f"path is of type {type(given['path']).__name__}",
                "give the name of a file with t_s,x_m,y_m,z_m, or None for the scene's own",
            )
        unit["path"] = str(folder / _name(f"{place}: path", given["path"]))
    return unit


def _name(what: str, file: PathLike) -> str:
    """A file's name that can be one. Raises ArgumentError."""
    try:
        return os.fsdecode(file_name(what, file))
    except FileError as error:
        raise ArgumentError(str(error)) from None


def _units(units: Iterable[Mapping[str, Any]] | PathLike) -> list[_Unit]:
    folder = Path.cwd()
    if isinstance(units, (str, os.PathLike)):
        folder = Path(units).absolute().parent
        try:
            units = json.loads(Path(units).read_text(encoding="utf-8"))
        except OSError as error:
            raise FileError(f"{units}: {error.strerror}; name a list of units (JSON)") from None
        except ValueError as error:
            raise FileError(f"{units}: {error}; give a list of units (JSON)") from None
    if isinstance(units, Mapping) or not isinstance(units, Iterable):
        raise ArgumentError("units: are no list; give a list of dicts, or a file's name (JSON)")
    plain = [_unit(unit, i, folder) for i, unit in enumerate(units)]
    if not plain:
        raise ArgumentError("units: are none; give one at least")
    seen: dict[str, int] = {}
    for i, unit in enumerate(plain):
        first = seen.setdefault(_file_name(unit), i)
        if first != i:
            raise ArgumentError(
                f"units[{i}]: has scan and structure of units[{first}]; give each pair once"
            )
    return plain


def _file_name(unit: _Unit) -> str:
    pair = f"{unit['scan']}\0{unit['structure']}"
    readable = re.sub(r"[^A-Za-z0-9._-]+", "_", f"{unit['scan']}-{unit['structure']}")[:80]
    return f"{readable}-{hashlib.sha256(pair.encode()).hexdigest()[:8]}.json"


def _called(unit: _Unit) -> str:
    return f"scan {unit['scan']}, structure {unit['structure']}"


# One unit


@functools.lru_cache(maxsize=256)
def _hash_of(file: bytes, size: int, changed_ns: int) -> str:
    digest = hashlib.sha256()
    with open(file, "rb") as data:
        while block := data.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()


def _file_hash(file: bytes) -> str:
    try:
        state = os.stat(file)
        return _hash_of(file, state.st_size, state.st_mtime_ns)
    except OSError as error:
        raise FileError(f"{os.fsdecode(file)}: {error.strerror}; bring it back") from None


def _scene_text(unit: _Unit) -> str:
    if unit["scene"] is not None:
        return unit["scene"]
    try:
        return Path(unit["file"]).read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        raise FileError(f"{unit['file']}: {error}; name a scene file (TOML)") from None


def _key(unit: _Unit, text: str, extracts: bool) -> str:
    """Changes with whatever changes the unit's result: its settings, the content of files, and
    whether meshes of volumes are made, as the contact is another one without them."""
    files = _palpate.Scene.files(text, os.fsencode(unit["file"]))
    if unit["path"] is not None:
        files.append(os.fsencode(unit["path"]))
    told = {**unit, "scene": text, "version": _palpate.version, "extraction": extracts}
    told["files"] = [_file_hash(file) for file in files]
    return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()


def _read(file: Path) -> dict[str, Any] | None:
    """A unit's file; None where there is none. Never mistakes another file for one."""
    try:
        kept = json.loads(file.read_bytes())
    except FileNotFoundError:
        return None
    except (OSError, ValueError):
        kept = None
    if not isinstance(kept, dict) or _MARK not in kept:
        raise FileError(f"{file}: is no result of study_many; name another folder as out")
    return kept


def _write(file: Path, text: str) -> None:
    """Under its name it is whole or not there."""
    handle, part = tempfile.mkstemp(prefix=f".{file.name}.", suffix=".part", dir=file.parent)
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="") as out:
            out.write(text)
            out.flush()
            os.fsync(out.fileno())
        os.chmod(part, 0o666 & ~_umask())
        os.replace(part, file)
    except BaseException:
        os.unlink(part)
        raise


def _umask() -> int:
    """Read as Linux tells it: to ask by setting it would change it for other threads."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    found = re.search(r"^Umask:\s*([0-7]+)$", status, re.MULTILINE)
    return int(found[1], 8) if found else 0o077


def _run(unit: _Unit, out: str, cache: str | None, extraction: bool | None) -> str | None:
    """Computes a unit that is not there yet; what is wrong with it is the result."""
    try:
        file = Path(out) / _file_name(unit)
        text = _scene_text(unit)
        extracts = _extractor(extraction) is not None
        key = _key(unit, text, extracts)
        kept = _read(file)
        if kept is not None and kept.get("key") == key:
            return None
        scene = Scene.from_text(text, file=unit["file"], cache=cache, extraction=extraction)
        result = study(scene, unit["path"], every=unit["every"], baselines=unit["baselines"])
        told = {
            _MARK: _palpate.version,
            "key": key,
            "extraction": extracts,
            "unit": unit,
            "csv": result.text,
        }
        _write(file, json.dumps(told, indent=1) + "\n")
    except Error as error:
        line = str(error)
        return line if unit["scene"] is None else _toml.without_lines(line, unit["scene"])
    except OSError as error:
        return f"{out}: {error.strerror}; name a folder that can be written"
    return None


# All of them


def _serially(units: list[_Unit], arguments: tuple[Any, ...]) -> list[str | None]:
    return [_run(unit, *arguments) for unit in units]


def _over_dask(
    units: list[_Unit], client: distributed.Client, arguments: tuple[Any, ...]
) -> list[str | None]:
    futures = [client.submit(_run, unit, *arguments, pure=False) for unit in units]
    try:
        return [
            " ".join(f"{type(error).__name__}: {error}".split())
            if (error := future.exception()) is not None
            else future.result()
            for future in futures
        ]
    finally:
        client.cancel(futures)


def _require_client(client: Any) -> None:
    try:
        import distributed
    except ImportError:
        raise Error(
            "client: needs the package distributed, which is not installed; install "
            "python3-distributed, or leave client out: the units then run one after the other"
        ) from None
    if not isinstance(client, distributed.Client):
        raise TypeError(
            f"client is of type {type(client).__name__}; give a distributed.Client or None"
        )


def _absolute(name: str, folder: PathLike) -> str:
    return str(Path(os.fsdecode(file_name(name, folder, "a folder's name"))).absolute())


def _folder(out: PathLike) -> Path:
    folder = Path(_absolute("out", out))
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"{out}: {error.strerror}; name a folder that can be written") from None
    return folder


def study_many(
    units: Iterable[Mapping[str, Any]] | PathLike,
    client: distributed.Client | None = None,
    *,
    out: PathLike = "study_many",
    cache: PathLike | None = None,
    extraction: bool | None = None,
) -> Studies:
    """Does `study` for each unit, as a structure of a scan; what is done is not done again.

    ``units``: dicts, or the name of a JSON file with a list of them. Each has ``scan`` and
    ``structure``, names that no other unit has both of; ``scene``, a scene file or a dict of plain
    values; and may have ``path`` (the name of a CSV file, else the scene's own device), ``every``
    and ``baselines`` as in `study`. File names are relative to the JSON file's folder, of dicts to
    the working folder.

    ``client``: a ``distributed.Client`` (Dask), whose workers import this package and see the same
    files. None: one unit after the other, here. A worker that is lost loses the unit that it was
    at; another one takes that over. Give each worker one thread, or the times count what the other
    does as well.

    ``out``: a folder, made where it is not there. Each unit's result is a file in it, which is
    whole or not there; study_many.csv and study_many_timing.csv are the tables. A unit is computed
    again where its settings, its files or the version have changed. ``cache`` and ``extraction``
    are those of `Scene`.

    Raises ArgumentError for what is wrong with the units before any is computed. Error where units
    failed: the others are kept, and the next call goes on from there.
    """
    if client is not None:
        _require_client(client)
    plain, folder = _units(units), _folder(out)
    kept = None if cache is None else _absolute("cache", cache)
    arguments = (str(folder), kept, extraction)
    if client is None:
        outcomes = _serially(plain, arguments)
    else:
        outcomes = _over_dask(plain, client, arguments)
    _require_all(plain, outcomes)
    return _merged(plain, folder)


def study_unit(
    units: Iterable[Mapping[str, Any]] | PathLike,
    unit: int,
    *,
    out: PathLike = "study_many",
    cache: PathLike | None = None,
    extraction: bool | None = None,
) -> None:
    """One unit of `study_many`, counted from 0, where it is not there yet: for a job array.

    `merge_studies` makes the table when all are there. Raises as `study_many`.
    """
    plain = _units(units)
    unit = integer("unit", unit, 0, len(plain) - 1)
    folder = _folder(out)
    kept = None if cache is None else _absolute("cache", cache)
    _require_all([plain[unit]], [_run(plain[unit], str(folder), kept, extraction)])


def _require_all(units: list[_Unit], outcomes: list[str | None]) -> None:
    failed = [f"{_called(u)}: {what}" for u, what in zip(units, outcomes) if what is not None]
    if failed:
        told = " | ".join(failed[:_TOLD])
        more = f" (and {len(failed) - _TOLD} more)" if len(failed) > _TOLD else ""
        raise Error(f"{len(failed)} of {len(units)} units failed: {told}{more}")


def merge_studies(
    units: Iterable[Mapping[str, Any]] | PathLike, *, out: PathLike = "study_many"
) -> Studies:
    """The table of units that are all there, in their order; writes it into ``out`` as CSV.

    The same results give the same bytes. Raises Error where a unit's result is missing or is of
    other settings; FileError where a file in ``out`` is somebody else's.
    """
    return _merged(_units(units), Path(_absolute("out", out)))


def _merged(units: list[_Unit], folder: Path) -> Studies:
    results: list[Study] = []
    missing = []
    extracts: set[bool] = set()
    for i, unit in enumerate(units):
        kept = _read(folder / _file_name(unit))
        if (
            kept is None
            or kept.get("unit") != unit
            or kept.get("key") != _key(unit, _scene_text(unit), bool(kept.get("extraction")))
            or not isinstance(kept.get("csv"), str)
        ):
            missing.append(i)
        else:
            results.append(Study(kept["csv"]))
            extracts.add(bool(kept.get("extraction")))
    if missing:
        raise Error(
            f"{folder}: has no result of {len(missing)} of {len(units)} units, as of "
            f"units[{missing[0]}] ({_called(units[missing[0]])}); compute them first"
        )
    if len(extracts) > 1:
        raise Error(
            f"{folder}: some units were computed with extraction and some without, which are other "
            "contacts; compute all of them alike"
        )
    for name in (_TABLE, _TIMING):
        _require_own(folder / name)
    table, timing = _csv(units, results, with_clock=False), _csv(units, results, with_clock=True)
    try:
        _write(folder / _TABLE, table)
        _write(folder / _TIMING, timing)
    except OSError as error:
        raise FileError(f"{folder}: {error.strerror}; name a folder that can be written") from None
    for unit in units:  # of workers that were killed while they wrote
        for part in folder.glob(f".{_file_name(unit)}.*.part"):
            part.unlink(missing_ok=True)
    studies = Studies(table)
    studies.timing = Study(timing)
    return studies


def _require_own(file: Path) -> None:
    try:
        with open(file, encoding="utf-8") as text:
            if text.readline().startswith("scan,structure,method,"):
                return
    except FileNotFoundError:
        return
    except (OSError, ValueError):
        pass
    raise FileError(f"{file}: was not written by study_many; name another folder as out")


def _csv(units: list[_Unit], results: list[Study], *, with_clock: bool) -> str:
    """The rows of all units, cell by cell as each has them."""
    text = io.StringIO()
    out = csv.writer(text, lineterminator="\n")
    columns = [
        name
        for name in results[0].columns
        if with_clock or not name.startswith(_BY_THE_CLOCK)
    ]
    out.writerow(["scan", "structure", *columns])
    for unit, result in zip(units, results):
        header, *rows = csv.reader(io.StringIO(result.text))
        chosen = [header.index(name) for name in columns]
        method = header.index("method")
        for row in rows:
            if with_clock or row[method] != _READS_THE_CLOCK:
                out.writerow([unit["scan"], unit["structure"], *(row[i] for i in chosen)])
    return text.getvalue()
