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
HEAD = ("key", "unit", "default", "allowed", "meaning")
ANY = (
    "a number above 0, at most 1e15",
    "a number above 0, 1e-6 to 1000",
)  # of which the page says that they go without


def with_tables(text: str) -> str:
    """A page with its tables as the classes have them."""
    return TABLE.sub(lambda found: found[1] + table(found[2]), text)


def table(name: str) -> str:
    """The keys of a section such as "blade" or "wear.duty", a row each."""
    section: type[BaseModel] = Scene
    for part in name.split("."):
        section = _section_in(section.model_fields[part].annotation)[0]
    rows = [HEAD, ("---",) * len(HEAD), *(_row(section, key, field) for key, field in section.model_fields.items())]
    lines = [f"| {' | '.join(row)} |".replace("|  |", "| |").replace("|  |", "| |") for row in rows]
    return "\n".join(["", *lines, "", ""])


def _section_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [section for part in get_args(annotation) for section in _section_in(part)]


def _row(section: type[BaseModel], key: str, field: FieldInfo) -> tuple[str, ...]:
    unit, allowed = meaning_in(section, key).unit, allowed_of(section, key)
    meaning = str(field.description)
    if unit:
        meaning = meaning.replace(f", {unit}", "", 1)
    words = re.sub(r'"[^"]+"', lambda word: f"`{word[0]}`", allowed)
    return f"`{key}`", unit, _default(field), "" if allowed in ANY else words, meaning


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
