"""Dotted keys of a scene: table and name, such as "contact" and "friction" or "interface.snubber" and "friction"."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

INTERFACE, CONTACT = "interface", "contact"
NO_INTERFACE = "no_contact"  # in the place of the interfaces of a sector that touches nothing (geometry.own_mesh)
NAMED_TABLES = (INTERFACE, "materials")  # that hold tables by name


def split_key(key: str) -> tuple[str, str]:
    """The table of a key and its name in there."""
    table, _, name = key.rpartition(".")
    return table, name


def interface_of(key: str) -> str:
    """The interface whose table a key, or the name of a table, is of; "" for all others."""
    first, _, rest = key.partition(".")
    return rest.rpartition(".")[0] if first == INTERFACE else ""


def of_contact(key: str) -> str:
    """The key of [contact] that means the same as a key of an interface; other keys as they are."""
    return f"{CONTACT}.{split_key(key)[1]}" if interface_of(key) else key


def table_in(raw: Mapping[str, Any], table: str) -> Any:
    """A table of a raw scene; None where there is none."""
    first, _, name = table.partition(".")
    found = raw.get(first)
    return found if not name else found.get(name) if isinstance(found, Mapping) else None


def with_table(raw: Mapping[str, Any], table: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """A raw scene with a table in place of the one that it has."""
    first, _, name = table.partition(".")
    return {**raw, first: {**raw.get(first, {}), name: values} if name else values}


def flattened_keys(table: Mapping[str, Any]) -> dict[str, Any]:
    """Dotted keys with their values, also of those that stand in tables such as [map.over.contact]."""
    found: dict[str, Any] = {}
    for name, item in table.items():
        inner = flattened_keys(item) if isinstance(item, Mapping) else {"": item}
        found |= {f"{name}.{last}" if last else name: each for last, each in inner.items()}
    return found
