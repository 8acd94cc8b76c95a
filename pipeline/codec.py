"""Dataclasses as plain values of JSON and as attributes of HDF5, and back."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from enum import Enum
from functools import cache
from types import NoneType, UnionType
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

T = TypeVar("T")


def plain(value: Any) -> Any:
    """A value as JSON has it: dataclasses as tables, arrays and tuples as lists, null for NaN and infinity."""
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if hasattr(value, "tolist"):  # arrays and numbers of NumPy
        return plain(value.tolist())
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Mapping):
        return {str(name): plain(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def restored(kind: Any, value: Any) -> Any:
    """The value that `plain` was given, of a type."""
    origin, inner = get_origin(kind), get_args(kind)
    if is_dataclass(kind) and isinstance(kind, type):
        hints = _hints(kind)
        return kind(**{name: restored(hints[name], item) for name, item in value.items()})
    if isinstance(kind, type) and issubclass(kind, Enum):
        return kind(value)
    if origin in (Union, UnionType):
        others = [each for each in inner if each is not NoneType]
        fitting = [
            each for each in others if is_dataclass(each) and {f.name for f in fields(each)} == set(value or ())
        ]
        return None if value is None and len(others) < len(inner) else restored([*fitting, *others][0], value)
    if getattr(origin, "__name__", "") == "ndarray":
        import numpy as np

        (scalar,) = get_args(inner[1])
        return np.array([math.nan if item is None else item for item in value], dtype=scalar)
    if origin is tuple:
        kinds = [inner[0]] * len(value) if len(inner) == 2 and inner[1] is Ellipsis else inner
        return tuple(restored(each, item) for each, item in zip(kinds, value, strict=True))
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return {name: restored(inner[1], item) for name, item in value.items()}
    return (math.nan if value is None else float(value)) if kind is float else value


def attributes_of(record: Any) -> dict[str, Any]:
    """The fields of a record as attributes of HDF5: numbers and texts as they are, tuples as JSON texts."""
    values = {field.name: getattr(record, field.name) for field in fields(record)}
    return {name: json.dumps(value) if isinstance(value, tuple) else value for name, value in values.items()}


def from_attributes(kind: type[T], attributes: Mapping[str, Any]) -> T:
    """The record of attributes, or of its fields as JSON has them, each made the type of its field.

    A field that is missing has its default. KeyError where it has none.
    """
    hashable: Any = kind
    given = {name: attributes[name] for name, _, optional in _readers(hashable) if not optional or name in attributes}
    return kind(
        **{
            name: read(json.loads(given[name]) if read is tuple and isinstance(given[name], str) else given[name])
            for name, read, _ in _readers(hashable)
            if name in given
        }
    )


def prefixed_values(prefix: str, record: Any) -> dict[str, Any]:
    """The fields of a record with a prefix, as a record that contains it has them; none where there is no record."""
    return {} if record is None else {f"{prefix}{f.name}": getattr(record, f.name) for f in fields(record)}


def of_prefix(kind: type[T], prefix: str, record: Any) -> T:
    """The inverse of `prefixed_values`: a part of a record from those fields that have the prefix."""
    hashable: Any = kind
    return kind(**{name: getattr(record, f"{prefix}{name}") for name, _, _ in _readers(hashable)})


@cache
def _hints(kind: Any) -> dict[str, Any]:
    """Types of the fields of a dataclass, which take long to resolve."""
    return get_type_hints(kind)


@cache
def _readers(kind: Any) -> list[tuple[str, Any, bool]]:
    """Name and type of each field, and whether it has a default."""
    hints = _hints(kind)
    return [(f.name, get_origin(hints[f.name]) or hints[f.name], f.default is not MISSING) for f in fields(kind)]
