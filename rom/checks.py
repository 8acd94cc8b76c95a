"""Checks of single parameters."""

from __future__ import annotations

import math
import numbers

from rom.errors import RomParameterError


def require_between(table: str, parameter: str, value: object, low: float, high: float, allowed: str) -> None:
    """Raise RomParameterError unless value is a number strictly between low and high (so never NaN or infinite)."""
    number = float(value) if isinstance(value, numbers.Real) and not isinstance(value, bool) else math.nan
    if not low < number < high:
        raise RomParameterError(table, parameter, value, allowed)
