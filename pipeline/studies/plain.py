"""Results of studies as plain values of JSON, and back."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints


def plain(value: Any) -> Any:
    """A value as JSON has it: dataclasses as tables, arrays and tuples as lists, null for NaN and infinity."""
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if hasattr(value, "tolist"):  # arrays and numbers of NumPy
        return plain(value.tolist())
    if isinstance(value, Mapping):
        return {str(name): plain(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def restored(kind: Any, value: Any) -> Any:
    """The value that `plain` was given, of a type."""
    origin, inner = get_origin(kind), get_args(kind)
    if is_dataclass(kind) and isinstance(kind, type):
        hints = get_type_hints(kind)
        return kind(**{name: restored(hints[name], item) for name, item in value.items()})
    if origin in (Union, UnionType):
        others = [each for each in inner if each is not NoneType]
        return None if value is None and len(others) < len(inner) else restored(others[0], value)
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
