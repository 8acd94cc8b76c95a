"""The scene as its knobs stand, in the text of its file: comments and order are kept."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from typing import Any

from pipeline.scene.dotted_keys import split_key
from pipeline.scene.reading import toml_text

TABLE = re.compile(r"^\s*\[(?P<name>[^\[\]]+)\]\s*(#.*)?$")
VALUE = r'(?P<value>"[^"]*"|[^#"\[{]*?)'  # one line: a number, a word


def edited(text: str, values: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
    """The text of a scene with other values of some dotted keys and without its sweep.

    `wanted`: what it has to say; where the text cannot be brought to that line by line, that is written anew.
    """
    lines = _without_sweep(text.splitlines())
    for key, value in values.items():
        lines = _with_value(lines, key, toml_text({"x": value}).partition("=")[2].strip())
    found = "\n".join(lines) + "\n"
    try:
        same = tomllib.loads(found) == tomllib.loads(toml_text(wanted))
    except tomllib.TOMLDecodeError:
        same = False
    return found if same else toml_text(wanted)


def _without_sweep(lines: list[str]) -> list[str]:
    kept, inside = [], False
    for line in lines:
        if line.lstrip().startswith("["):
            table = TABLE.match(line)
            inside = inside if table is None else table["name"].strip().split(".")[0] == "sweep"
        kept += [] if inside else [line]
    return kept


def _with_value(lines: list[str], key: str, value: str) -> list[str]:
    """The lines with a value in its place, or at the head of its table, or in a table of its own at the end."""
    table, name = split_key(key)
    current, head = "", 0 if not table else None
    for number, line in enumerate(lines):
        if (found := TABLE.match(line)) is not None:
            current = found["name"].strip()
            head = number + 1 if current == table else head
            continue
        own = name if current == table else key if not current else None
        if own is None:
            continue
        place = re.match(rf"^(?P<left>\s*{re.escape(own)}\s*=\s*){VALUE}(?P<right>\s*(#.*)?)$", line)
        if place is not None:
            return [*lines[:number], f"{place['left']}{value}{place['right']}", *lines[number + 1 :]]
    if head is None:
        return [*lines, "", f"[{table}]", f"{name} = {value}"]
    return [*lines[:head], f"{name} = {value}", *lines[head:]]
