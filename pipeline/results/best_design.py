"""The best design of a sweep: the one whose highest motion over the conditions is lowest.

Force, engine order, speed, damping, friction are conditions: a machine meets them, nobody chooses the mildest.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pipeline.scene.labels import value_label
from pipeline.scene.schema import has_role

# what is said where a design has been swept, and none is best
OPEN = "not known, every curve may be higher"
OPEN_OVER = "not known, every design has a curve that may be higher"
NOT_COMPARED = "not known, no design was computed under all conditions"


@dataclass(frozen=True)
class DesignPoint:
    """One curve, or point of a map, as designs are compared."""

    parameters: Mapping[str, Any]  # swept keys and their values
    height: float  # m; NaN where it is not known
    closed: bool  # whether nothing was left open that may be higher


@dataclass(frozen=True)
class BestDesign:
    """The best of some designs; places are those of the points that were compared."""

    design: Mapping[str, Any]  # its values
    highest: int  # place of its highest motion over the conditions
    lowest: int  # place of the lowest motion of all designs under any condition


def condition_keys(keys: Iterable[str]) -> list[str]:
    """Swept keys that are no choice of a design."""
    return [key for key in keys if not has_role(key, "design")]


def compares_designs(keys: Iterable[str]) -> bool:
    """Whether any swept key is a choice of a design."""
    return any(has_role(key, "design") for key in keys)


def best_design(points: Sequence[DesignPoint]) -> BestDesign | str:
    """The best design of those that were computed under all conditions and have nothing open, or why there is none.

    Without a swept condition it is the lowest point.
    """
    groups: dict[str, dict[str, list[int]]] = {}
    for place, point in enumerate(points):
        parts = (
            {k: v for k, v in point.parameters.items() if has_role(k, "design") == chosen} for chosen in (True, False)
        )
        design, condition = (json.dumps(part, sort_keys=True, default=str) for part in parts)
        own = str(place) if condition == "{}" else design
        groups.setdefault(own, {}).setdefault(condition, []).append(place)
    conditions = {condition for found in groups.values() for condition in found}
    complete = [
        [place for places in found.values() for place in places]
        for found in groups.values()
        if found.keys() == conditions
    ]
    if not complete:
        return NOT_COMPARED
    settled = [places for places in complete if all(_is_settled(points[place]) for place in places)]
    if not settled:
        return OPEN if len(conditions) == 1 else OPEN_OVER
    highest = min((max(places, key=lambda k: points[k].height) for places in settled), key=lambda k: points[k].height)
    lowest = min((k for k, point in enumerate(points) if _is_settled(point)), key=lambda k: points[k].height)
    values = {key: value for key, value in points[highest].parameters.items() if has_role(key, "design")}
    return BestDesign(values, highest, lowest)


def _is_settled(point: DesignPoint) -> bool:
    return point.closed and math.isfinite(point.height)


def values_label(parameters: Mapping[str, Any], design: bool) -> str:
    """The values of the design, or of the conditions."""
    return ", ".join(
        value_label(key, value) for key, value in parameters.items() if has_role(key, "design") == design
    )
