"""A scene from Python: a file or a dict, with some of its keys replaced."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from pipeline.errors import input_error, shown
from pipeline.scene.reading import Member, SceneFile, scene_of_tables, with_contents
from pipeline.scene.schema import NOT_SWEPT, SECTIONS
from pipeline.scene.sweep import LATIN_HYPERCUBE, POINTS, Sweep, read_sweep
from pipeline.scene.toml_text import load_tables, parsed

NAMELESS = Path("scene")  # how messages name a scene without a file
_BARE = re.compile(r"[A-Za-z0-9_-]+")


def given_scene(
    scene: SceneFile | Mapping[str, Any] | str | os.PathLike[str],
    overrides: Mapping[str, Any],
    given_model: bool = False,
) -> SceneFile:
    """A scene as it is given in Python, validated."""
    if isinstance(scene, SceneFile) and not overrides:
        return with_contents(scene, {})  # its files may have been written again
    if isinstance(scene, SceneFile):
        path, tables, text = scene.path, parsed(scene.path, scene.text), scene.text
    elif isinstance(scene, Mapping):
        path, tables, text = NAMELESS, _plain(scene), ""
    else:
        path = Path(scene)
        tables, text = load_tables(path)
    for key, value in sorted(overrides.items(), key=lambda item: not item[0].startswith("sweep")):
        _replace(path, tables, key, _plain(value))
    if overrides or not text:
        text = toml_text(tables)
    return scene_of_tables(path, tables, text, given_model)


def derived_member(file: SceneFile, values: Mapping[str, Any], place: str, given_model: bool = False) -> Member:
    """The first member of a scene with other values of some keys; nothing is swept, no picture asked for."""
    tables = dict(parsed(file.path, file.text))
    for name in ("sweep", *NOT_SWEPT):
        tables.pop(name, None)
    chosen = {key: [_plain(value)] for key, value in {**file.members[0].parameters, **values}.items()}
    sweep = Sweep(chosen, POINTS, (place,)) if chosen else Sweep({})
    derived = scene_of_tables(file.path, tables, "", given_model, swept=sweep, contents=file.contents)
    return replace(derived.members[0], parameters=dict(values), place=place)


def _replace(path: Path, tables: dict[str, Any], key: str, value: Any) -> None:
    """Put a value in the place of a dotted key, the keys of a table, or a key at the top."""
    table, _, name = key.partition(".")
    if not name and isinstance(value, Mapping) and table in (*SECTIONS, "sweep"):
        for inner, item in value.items():
            _replace(path, tables, f"{table}.{inner}", item)
    elif not name:
        _put(tables, table, value)
    else:
        inside = tables.setdefault(table, {})
        if not isinstance(inside, dict):
            raise input_error(path, table, shown(inside), f"a table [{table}]")
        section, _, swept = name.partition(".") if table == "sweep" else (table, "", name)
        if section in SECTIONS:
            _sweep_no_longer(path, tables, section, swept)
        _put(inside, name, value)


def _put(table: dict[str, Any], name: str, value: Any) -> None:
    if value is None:
        table.pop(name, None)
    else:
        table[name] = value


def _sweep_no_longer(path: Path, tables: dict[str, Any], section: str, name: str) -> None:
    """Take a key out of [sweep]."""
    sweep, key = tables.get("sweep"), f"{section}.{name}"
    if not isinstance(sweep, dict):
        return
    sweep.pop(key, None)
    if isinstance(inner := sweep.get(section), dict):
        inner.pop(name, None)
    kind = next((kind for kind in (POINTS, LATIN_HYPERCUBE) if kind in sweep), "")
    if kind and key in read_sweep(path, sweep).lists:
        raise input_error(path, key, f"swept by sweep.{kind}", "keys that are not swept, or sweep = None too")


def _plain(value: Any) -> Any:
    """Values of NumPy and paths as those that TOML has; a copy of tables and lists."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items() if item is not None}
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return os.fspath(value) if isinstance(value, os.PathLike) else value


def toml_text(tables: Mapping[str, Any]) -> str:
    """Tables of a scene as TOML, a line for each key."""
    top = [f"{_key(key)} = {_value(value)}" for key, value in tables.items() if not isinstance(value, Mapping)]
    for name, table in tables.items():
        if isinstance(table, Mapping):
            top += ["", f"[{_key(name)}]", *(f"{_key(key)} = {_value(value)}" for key, value in table.items())]
    return "\n".join(top) + "\n"


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else json.dumps(key, ensure_ascii=False)


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_key(key)} = {_value(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    return repr(value) if isinstance(value, float) else json.dumps(value, ensure_ascii=False, default=str)
