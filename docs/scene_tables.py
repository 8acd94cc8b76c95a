"""The tables of keys in scene.md, made from the classes of the sections; `python docs/scene_tables.py` renews them.

A table stands between a line `<!-- keys of NAME -->` and a line `<!-- end -->`.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from pipeline.scene.fields import allowed_of, meaning_in
from pipeline.scene.schema import Scene

PAGE = Path(__file__).parent / "scene.md"
TABLE = re.compile(r"(<!-- keys of ([\w.]+) -->\n).*?(?=<!-- end -->)", re.DOTALL)
HEAD = ("key", "default", "unit, allowed", "meaning")
ANY = (
    "a number above 0, at most 1e15",
    "a number above 0, 1e-6 to 1000",
)  # of which the page says that they go without
UNIT = r", (Pa|1/K|kg/m\^3|N/m|Hz|N|m|rev/min|degrees)(?=[;:,]| for each|$)"  # of keys whose annotation has none
LONG = 6  # words of what is allowed, from which on the page says it once


def with_tables(text: str) -> str:
    """A page with its tables as the classes have them; what is long and allowed for several keys stands once."""
    first: dict[str, str] = {}
    return TABLE.sub(lambda found: found[1] + table(found[2], first), text)


def table(name: str, first: dict[str, str]) -> str:
    """The keys of a section such as "blade" or "wear.duty", a row each; `first`: long texts with their first keys."""
    section: type[BaseModel] = Scene
    for part in name.split("."):
        section = _section_in(section.model_fields[part].annotation)[0]
    keys = [_row(section, key, field) for key, field in section.model_fields.items()]
    for place, (key, default, allowed, meaning) in enumerate(keys):
        where = first.setdefault(allowed, f"`{name}.{key.strip('`')}`") if len(allowed.split()) > LONG else ""
        if where and where != f"`{name}.{key.strip('`')}`":
            keys[place] = (key, default, f"as {where}", meaning)
    rows = [HEAD, ("---",) * len(HEAD), *keys]
    lines = [f"| {' | '.join(row)} |".replace("|  |", "| |").replace("|  |", "| |") for row in rows]
    return "\n".join(["", *lines, "", ""])


def _section_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [section for part in get_args(annotation) for section in _section_in(part)]


def _row(section: type[BaseModel], key: str, field: FieldInfo) -> tuple[str, ...]:
    unit, allowed = meaning_in(section, key).unit, allowed_of(section, key)
    meaning = re.sub(r"[;,] relative to the scene file", "", str(field.description))
    if unit:
        meaning = meaning.replace(f", {unit}", "", 1)
    if not unit and (found := re.search(UNIT, meaning)):
        unit, meaning = found[1], meaning.replace(found[0], "", 1)
    words = re.sub(r'"[^"]+"', lambda word: f"`{word[0]}`", _short(allowed))
    limits = ", ".join(filter(None, (unit, "" if allowed in ANY else words)))
    return f"`{key}`", _default(field), limits, meaning


def _short(allowed: str) -> str:
    """What is allowed without the words that the head of the page spares the reader."""
    text = re.sub(r"^(?:a number,? (?=-?\d|above)|the name of (?=a))", "", allowed)
    text = re.sub(r"^a whole number, ", "whole, ", text)
    text = re.sub(r"^-1e15 to 1e15", "any number", text)
    text = re.sub(r", -1e15 to 1e15|(?<=above 0), at most 1e15", "", text)
    return re.sub(r"(?<=\d) to (?:1e15|9\d{15,})\b", " or more", text)


def _default(field: FieldInfo) -> str:
    """The default as a scene writes it; nothing where the meaning says what holds."""
    value = field.default
    if field.is_required():
        return "required"
    if isinstance(value, str):
        return f'`"{value}"`' if value else ""
    if isinstance(value, bool | int | float):
        return json.dumps(value) if isinstance(value, bool) else f"{value:g}"
    return f"`{json.dumps(value)}`" if isinstance(value, tuple) and value else ""


if __name__ == "__main__":
    PAGE.write_text(with_tables(PAGE.read_text()))
