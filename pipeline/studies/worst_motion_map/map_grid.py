"""The grid of a map: values of its two keys, and the values at places between them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

Place = tuple[float, float]


@dataclass(frozen=True)
class MapAxis:
    """One key of a map."""

    key: str  # its dotted key
    values: tuple[float, ...]  # ascending values of the grid, in SI units
    logarithmic: bool = False  # whether values between them lie in the middle of the logarithm

    def value_at(self, place: float) -> float:
        """Value at a column or row, which may be a fraction."""
        below = min(int(place), len(self.values) - 2)
        low, high, part = self.values[below], self.values[below + 1], place - below
        if part in (0.0, 1.0):
            return high if part else low
        if self.logarithmic:
            return rounded(low * (high / low) ** part)
        return rounded(low + part * (high - low))


@dataclass(frozen=True)
class MapGrid:
    """The grid of a map: its two keys, columns first."""

    axes: tuple[MapAxis, MapAxis]

    def values_at(self, place: Place) -> tuple[float, float]:
        """Values of both keys at a column and row."""
        return self.axes[0].value_at(place[0]), self.axes[1].value_at(place[1])

    def places(self) -> list[Place]:
        """Column and row of all points of the grid, the row changing fastest."""
        columns, rows = (range(len(axis.values)) for axis in self.axes)
        return [(float(column), float(row)) for column in columns for row in rows]


def rounded(value: float) -> float:
    """A value to 12 digits: the same number, whatever way it was computed."""
    return float(f"{value:.12g}")


def spaced(low: float, high: float, count: int, logarithmic: bool) -> tuple[float, ...]:
    """`count` values from `low` to `high`, evenly spaced, or evenly in their logarithm and rounded to four digits."""
    if logarithmic:
        ratio = math.log(high / low) / (count - 1)
        inner = tuple(float(f"{low * math.exp(k * ratio):.4g}") for k in range(1, count - 1))
        return (low, *inner, high)
    step = (high - low) / (count - 1)
    inner = tuple(rounded(low + k * step) for k in range(1, count - 1))
    return (low, *(0.0 if abs(value) < 1e-9 * step else value for value in inner), high)


def even_in_logarithm(values: Sequence[float]) -> bool:
    """Whether positive values are spaced more evenly in their logarithm than as they stand."""
    if len(values) < 3 or values[0] <= 0.0:
        return False
    steps = [high - low for low, high in pairwise(values)]
    ratios = [math.log(high / low) for low, high in pairwise(values)]
    return max(ratios) / min(ratios) < max(steps) / min(steps)
