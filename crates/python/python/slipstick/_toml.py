"""Writes Python values as TOML, for the case reader."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

Files = dict[str, bytes]
"""Contents of the mesh files that exist only in memory, by name."""


def document(case: Mapping[str, Any], files: Files) -> str:
    """The text of a case: tables under their headings, values within them on one line each.

    Meshes are added to `files`.
    """
    plain: list[str] = []
    tables: list[str] = []
    for key, entry in _items(case, "the case"):
        # a deck stands before the first table
        if isinstance(entry, Mapping) and key != "deck":
            tables += ["", f"[{key}]", *_lines(entry, key, files)]
        elif _is_list_of_tables(entry):
            for number, table in enumerate(entry):
                tables += ["", f"[[{key}]]", *_lines(table, f"{key}[{number}]", files)]
        else:
            plain.append(f"{key} = {value(entry, key, files)}")
    return "\n".join([*plain, *tables]).lstrip("\n") + "\n"


def value(entry: Any, name: str, files: Files) -> str:
    """A value on one line; `name` is for messages."""
    if isinstance(entry, (bool, np.bool_)):
        return "true" if entry else "false"
    if isinstance(entry, (int, np.integer)):
        return str(int(entry))
    if isinstance(entry, (float, np.floating)):
        number = float(entry)
        if not math.isfinite(number):
            return "nan" if math.isnan(number) else ("inf" if number > 0 else "-inf")
        return repr(number)
    if hasattr(entry, "_as_file"):
        return _mesh(entry, name, files)
    if isinstance(entry, (str, os.PathLike)):
        # JSON escapes what TOML does, and both read the same escapes
        return json.dumps(os.fspath(entry), ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(entry, Mapping):
        parts = [
            f"{key} = {value(inner, f'{name}.{key}', files)}" for key, inner in _items(entry, name)
        ]
        return "{ " + ", ".join(parts) + " }" if parts else "{}"
    if isinstance(entry, np.ndarray):
        entry = entry.tolist()
        if not isinstance(entry, list):
            return value(entry, name, files)
    if isinstance(entry, Sequence):
        parts = [value(inner, f"{name}[{number}]", files) for number, inner in enumerate(entry)]
        return "[" + ", ".join(parts) + "]"
    if entry is None:
        raise TypeError(f"`{name}` is None: leave the key out to get its default")
    raise TypeError(
        f"`{name}` is of type {type(entry).__name__}, which a case cannot hold: "
        "give a string, a number, a boolean, a list or a dict"
    )


def _items(table: Mapping[str, Any], name: str) -> list[tuple[str, Any]]:
    for key in table:
        if not isinstance(key, str):
            raise TypeError(f"{name} has the key {key!r}: keys are strings")
    return [(_key(key), entry) for key, entry in table.items()]


def _key(key: str) -> str:
    bare = key.isascii() and key.replace("_", "").replace("-", "").isalnum()
    return key if bare else json.dumps(key, ensure_ascii=False)


def _lines(table: Mapping[str, Any], name: str, files: Files) -> list[str]:
    return [f"{key} = {value(entry, f'{name}.{key}', files)}" for key, entry in _items(table, name)]


def _mesh(mesh: Any, name: str, files: Files) -> str:
    """A mesh: the name of its file, or a table with that name."""
    file, data = mesh._as_file()
    files[file] = data
    if name.endswith(".file"):
        return json.dumps(file)
    bodies = list(mesh.bodies)
    if len(bodies) > 1:
        raise ValueError(
            f"`{name}` is a mesh with the bodies {', '.join(bodies)}: choose one, "
            f'for instance {{"file": mesh, "part": {bodies[0]!r}}}'
        )
    return f"{{ file = {json.dumps(file)} }}"


def _is_list_of_tables(entry: Any) -> bool:
    is_list = isinstance(entry, Sequence) and not isinstance(entry, (str, bytes))
    return is_list and len(entry) > 0 and all(isinstance(table, Mapping) for table in entry)
