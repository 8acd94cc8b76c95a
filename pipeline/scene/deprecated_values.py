"""Spellings of scene values that are still read, and what they are called now."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pipeline.errors import shown

# dotted key -> earlier spelling -> today's
DEPRECATED_VALUES: dict[str, dict[str, str]] = {
    "contact.law": {"uncoupled": "two_sliders", "coupled": "cone"},
    "response.stability": {"floquet": "ring"},
}


def with_current_values(
    path: Path, raw: Mapping[str, Any], sweep: Mapping[str, list[Any]]
) -> tuple[dict[str, Any], dict[str, list[Any]], tuple[str, ...]]:
    """Replace deprecated values in a raw scene and in the lists of its sweep."""
    raw, sweep = dict(raw), dict(sweep)
    notes: dict[str, None] = {}
    for key, spellings in DEPRECATED_VALUES.items():
        section, _, name = key.partition(".")
        table = raw.get(section)
        if isinstance(table, Mapping) and (old := _deprecated(table.get(name), spellings)):
            raw[section] = {**table, name: spellings[old]}
            notes[_note(path, key, old, spellings[old])] = None
        for index, value in enumerate(sweep.get(key, ())):
            if old := _deprecated(value, spellings):
                sweep[key] = [*sweep[key][:index], spellings[old], *sweep[key][index + 1 :]]
                notes[_note(path, f'sweep."{key}"', old, spellings[old])] = None
    return raw, sweep, tuple(notes)


def _deprecated(value: Any, spellings: Mapping[str, str]) -> str:
    """The value where it is a deprecated spelling, otherwise an empty text."""
    return value if isinstance(value, str) and value in spellings else ""


def _note(path: Path, key: str, old: str, new: str) -> str:
    return f"{path}: {key} = {shown(old)} is now spelled {shown(new)}"
