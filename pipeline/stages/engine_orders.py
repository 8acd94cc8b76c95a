"""Engine orders that a scene excites, and the members of a sweep that differ in the speed alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

if TYPE_CHECKING:
    from pipeline.scene.schema import Scene

SPEED = "load.speed_rpm"
WITH_SPEED = ("load.speed_rpm", "load.temperature_factor")
FEWEST = 3  # speeds needed for a Campbell diagram
COUNT = 10  # lowest modes of each nodal diameter that are looked at


class Swept(Protocol):
    """Something with the values of the swept keys."""

    @property
    def parameters(self) -> Mapping[str, Any]:
        """Swept keys and values."""


Of = TypeVar("Of", bound=Swept)


def excited_orders(scene: Scene, engine_order: int | None = None) -> list[tuple[int, tuple[float, float]]]:
    """Engine orders of the excitation with their frequency ranges, Hz; a multiple h has h times the range.

    `engine_order` takes the place of that of the scene.
    """
    low, high = scene.response.frequency
    order = scene.excitation.engine_order if engine_order is None else engine_order
    multiples = sorted({1, *(item.order for item in scene.excitation.harmonic)})
    return [(h * order, (h * low, h * high)) for h in multiples]


def by_speed(items: Sequence[Of]) -> dict[float, Of]:
    """Those that differ from the first one only in the speed (rev/min) and its heat, by speed."""
    first = {key: value for key, value in items[0].parameters.items() if key not in WITH_SPEED}
    chosen: dict[float, Of] = {}
    for item in items:
        others = {key: value for key, value in item.parameters.items() if key not in WITH_SPEED}
        if SPEED in item.parameters and others == first:
            chosen.setdefault(float(item.parameters[SPEED]), item)
    return chosen
