"""Sections [stress] and [fatigue] of a scene: stress on the mesh at the worst motion, and fatigue margins."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from pipeline.scene.fields import POSITIVE, Number, Positive, Section, Truth, Whole, key

LIMIT = f"{POSITIVE}, or a table of such numbers by the name of the material, not above the tensile strength"
Limit = Positive | Annotated[dict[str, Positive], Field(min_length=1)]


class Stress(Section):
    """[stress]: stress on the mesh at the worst motion. Not computed unless this section or [fatigue] is there."""

    curves: Truth | Annotated[tuple[Annotated[Whole, Field(ge=0)], ...], Field(min_length=1, max_length=20)] = key(
        "true for the curves with the highest and the lowest worst motion, false for none, or their numbers from 0",
        "true, false or a list of 1 to 20 numbers of curves, the first is 0",
        True,
    )
    hot_spots: Whole = key("number of hot spots listed", "a whole number, 1 to 50", 5, ge=1, le=50)
    check: Truth = key(
        "whether the harmonics are compared with a solution of the full model under the same forces",
        "true or false",
        True,
    )


class Fatigue(Section):
    """[fatigue]: limits of the material, for the margins of the stress cycles."""

    endurance_limit: Limit = key("amplitude of a fully reversed cycle that is endured, Pa", LIMIT)
    tensile_strength: Limit = key(
        "ultimate tensile strength, Pa", f"{POSITIVE}, or a table of such numbers by the name of the material"
    )
    yield_strength: Limit | None = key("yield strength, Pa; none: no yield line", LIMIT, None)
    factor: Number = key("margin that is required", "a number from 0.1 to 100", 1.0, ge=0.1, le=100.0)

    def limits_of(self, material: str) -> tuple[float, float, float | None] | None:
        """Endurance limit, tensile and yield strength of a material; None where there are none for it."""
        found = [_of(value, material) for value in (self.endurance_limit, self.tensile_strength, self.yield_strength)]
        if found[0] is None or found[1] is None:
            return None
        return found[0], found[1], found[2]

    @property
    def named(self) -> tuple[str, ...]:
        """Materials that have limits of their own; "" stands for all others."""
        tables = [
            v for v in (self.endurance_limit, self.tensile_strength, self.yield_strength) if isinstance(v, dict)
        ]
        return ("", *dict.fromkeys(name for table in tables for name in table))


def _of(value: Limit | None, material: str) -> float | None:
    return value.get(material) if isinstance(value, dict) else value
