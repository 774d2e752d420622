# SPDX-License-Identifier: Apache-2.0
"""A scene's dict as TOML text, which the reader of scene files then checks like any other."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from palpate.errors import SceneError

_MOST_DEPTH = 12  # a scene has tables of tables of lists of pairs


def _fail(place: str, what: str, remedy: str) -> SceneError:
    return SceneError(f"dict: {place or 'the scene'} {what}; {remedy}")


def _text(text: str, place: str) -> str:
    try:
        text.encode()
    except UnicodeEncodeError:
        raise _fail(place, "has a character that is no text", "give Unicode text") from None
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _key(key: Any, place: str) -> str:
    if not isinstance(key, str):
        raise _fail(place, f"has the key {key!r}, which is no string", "give keys in quotes")
    return _text(key, place)


def _plain(value: Any) -> Any:
    """Without numpy and paths; anything else as it is."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    return os.fspath(value) if isinstance(value, os.PathLike) else value


def _value(value: Any, place: str, depth: int = 0) -> str:
    value = _plain(value)
    if depth > _MOST_DEPTH:
        raise _fail(place, "is too deep", "a scene needs no such thing: give tables of values")
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        if not -(2**63) <= value < 2**63:
            raise _fail(place, "is an integer of more than 64 bits", "give a smaller number")
        return str(value)
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, str):
        return _text(value, place)
    if isinstance(value, (list, tuple)):
        parts = (_value(part, f"{place}[{i}]", depth + 1) for i, part in enumerate(value))
        return "[" + ", ".join(parts) + "]"
    if isinstance(value, Mapping):
        parts = (
            f"{_key(key, place)} = {_value(part, f'{place}.{key}', depth + 1)}"
            for key, part in value.items()
        )
        return "{" + ", ".join(parts) + "}"
    if value is None:
        raise _fail(place, "is None", "leave the key out, or give it a value")
    raise _fail(
        place,
        f"is of type {type(value).__name__}",
        "give a number, a string, True or False, a list or a dict",
    )


def _are_tables(values: Iterable[Any]) -> bool:
    return all(isinstance(value, Mapping) for value in values)


class Noted(dict[str, Any]):
    """A table whose header has a comment."""

    def __init__(self, table: Mapping[str, Any], note: str) -> None:
        super().__init__(table)
        self.note = note


def _section(header: str, table: Mapping[str, Any], place: str) -> str:
    lines = [f"{header}  # {table.note}" if isinstance(table, Noted) else header]
    for key, part in table.items():
        lines.append(f"{_key(key, place)} = {_value(part, f'{place}.{key}')}")
    return "\n".join(lines) + "\n"


def without_lines(message: str, text: str) -> str:
    """What the reader says of the text of a dict, whose lines nobody has seen.

    "dict:7: ..." becomes "dict: effect[1]: ..." where a list of tables holds that line; other
    tables have their names in the message anyway.
    """

    def place(found: re.Match[str]) -> str:
        before = text.split("\n")[: int(found[1])]  # as the reader of TOML counts lines
        headers = [line for line in before if line.startswith("[")]
        if not headers or not headers[-1].startswith("[["):
            return "dict: "
        return f"dict: {json.loads(headers[-1][2:-2])}[{headers.count(headers[-1]) - 1}]: "

    return re.sub(r"\bdict:(\d+): ", place, message)


def scene_text(scene: Mapping[str, Any]) -> str:
    """The TOML text of a scene's tables; numbers keep every bit. Raises SceneError."""
    plain, sections = [], []
    for key, value in scene.items():
        name = _key(key, "")
        if isinstance(value, Mapping):
            if value and _are_tables(value.values()):
                for sub, table in value.items():
                    header = f"[{name}.{_key(sub, key)}]"
                    sections.append(_section(header, table, f"{key}.{sub}"))
            else:
                sections.append(_section(f"[{name}]", value, key))
        elif isinstance(value, (list, tuple)) and value and _are_tables(value):
            for i, table in enumerate(value):
                sections.append(_section(f"[[{name}]]", table, f"{key}[{i}]"))
        else:
            plain.append(f"{name} = {_value(value, key)}\n")
    return "".join(plain) + "\n".join(sections)
