"""Axes of a map: linear, logarithmic, or with its values side by side."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipeline.figures.data import SweepKey
from pipeline.scene.labels import quantity
from pipeline.studies.worst_motion_map.map_grid import MapAxis

if TYPE_CHECKING:
    from matplotlib.axis import Axis

Array = NDArray[np.float64]
FINEST = 60.0  # ratio of the whole range to the smallest step above which values stand side by side
MOST_TICKS = 10


@dataclass(frozen=True)
class MapScale:
    """The axis of one key of a map."""

    axis: MapAxis

    @cached_property
    def is_side_by_side(self) -> bool:
        """Whether the values of the grid are drawn at equal distances, because some would lie on each other."""
        if self.axis.logarithmic:
            return False
        steps = np.diff(self.axis.values)
        return bool(steps.sum() > FINEST * steps.min())

    @cached_property
    def of_values(self) -> Array:
        """Coordinates of the values of the grid."""
        values = np.array(self.axis.values) * quantity(self.axis.key).factor
        if self.is_side_by_side:
            return np.arange(len(values), dtype=float)
        return np.log10(values) if self.axis.logarithmic else values

    def coordinates(self, places: Array) -> Array:
        """Coordinates of columns or rows, which may be fractions."""
        return np.interp(places, np.arange(len(self.of_values)), self.of_values)

    def label(self, axis: Axis) -> None:
        """Ticks, their labels and the label of an axis."""
        key = SweepKey(self.axis.key, self.axis.values)
        axis.set_label_text(key.axis)
        if self.is_side_by_side:
            shown = range(0, len(key.values), -(-len(key.values) // MOST_TICKS))
            axis.set_ticks(list(shown), [key.text(key.values[number]) for number in shown])
        elif self.axis.logarithmic:
            ticks = plain_numbers(*(10.0 ** self.of_values[[0, -1]]))
            axis.set_ticks(np.log10(ticks).tolist(), [f"{tick:g}" for tick in ticks])


def plain_numbers(low: float, high: float, fewest: int = 4) -> list[float]:
    """Numbers such as 1, 2, 5, 10 within a range of positive numbers, few but at least `fewest` where there are."""
    ladder = ((1.0,), (1.0, 3.0), (1.0, 2.0, 5.0), (1.0, 1.5, 2.0, 3.0, 5.0, 7.0), tuple(np.arange(10, 100) / 10.0))
    decades = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    found: list[float] = []
    for digits in ladder:
        steps = (float(f"{digit}e{decade}") for decade in decades for digit in digits)
        found = [step for step in steps if low * (1.0 - 1e-9) <= step <= high * (1.0 + 1e-9)]
        if len(found) >= fewest:
            break
    return found
