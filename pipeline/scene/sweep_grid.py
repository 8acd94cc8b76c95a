"""Whether the points of a sweep are a full grid, and along which values."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any


def grid_values(parameters: Mapping[str, Sequence[Any]]) -> dict[str, list[Any]] | None:
    """The different values of each swept key where the points are every combination of them, each once.

    Shapes: `parameters` (n,).
    """
    count = len(next(iter(parameters.values()), ()))
    values = {key: list(dict.fromkeys(found)) for key, found in parameters.items()}
    if not parameters or math.prod(len(found) for found in values.values()) != count:
        return None
    return values if len(set(zip(*parameters.values(), strict=True))) == count else None
