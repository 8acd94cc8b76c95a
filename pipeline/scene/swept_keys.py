"""Keys of a scene that can be swept, as a table of [sweep] names them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from pipeline.errors import input_error
from pipeline.scene.schema import NOT_SWEPT, NOT_SWEPT_KEYS, SECTIONS
from pipeline.scene.validation_errors import shown_key, unknown_key

SWEPT_KEYS = tuple(
    key
    for section, model in SECTIONS.items()
    if section not in NOT_SWEPT
    for key in (f"{section}.{name}" for name in model.model_fields)
    if key not in NOT_SWEPT_KEYS
)


def flattened(path: Path, table: Mapping[str, Any], place: str) -> Iterator[tuple[str, Any]]:
    """Dotted keys with what stands under them, whether written "contact.friction" or contact.friction."""
    found = set()
    for key, item in _items(table):
        if key in found:
            section, _, name = key.partition(".")
            said = f'given twice, as "{key}" and as {name} of [{place}.{section}]'
            raise input_error(path, f"{place}.{shown_key(key)}", said, "one of the two")
        if key not in SWEPT_KEYS:
            raise unknown_key(path, key, SWEPT_KEYS, place)
        found.add(key)
        yield key, item


def _items(table: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    for key, value in table.items():
        if isinstance(value, Mapping) and key in SECTIONS:
            yield from ((f"{key}.{name}", inner) for name, inner in value.items())
        else:
            yield key, value
