"""Section [optimum] of a scene: the keys over which the worst motion is made as low as possible."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from pipeline.scene.fields import Number, StudyKeys, key

MOST_KEYS = 6
RANGES = f"a table of 1 to {MOST_KEYS} dotted keys, each with a list of two numbers, the second above the first"
Objective = Literal["displacement", "harmonic_1"]
Range = tuple[Number, Number]
Ranges = Annotated[dict[str, Range], Field(min_length=1, max_length=MOST_KEYS)]
OBJECTIVES = {"displacement": "largest displacement", "harmonic_1": "first harmonic"}  # what amplitudes are


class Optimum(StudyKeys):
    """[optimum]: values of keys of the scene that make its worst motion lowest. Not sought without this section."""

    over: Annotated[dict[str, Range | Ranges], Field(min_length=1, max_length=MOST_KEYS)] = key(
        "keys of the scene with the ranges in which they may lie", RANGES
    )

    objective: Objective = key(
        "what is made low: the largest displacement over a period, or its first harmonic alone",
        '"displacement" or "harmonic_1"',
        "displacement",
    )

    @property
    def ranges(self) -> dict[str, Range]:
        """The range of every dotted key, also of those that stand in tables such as [optimum.over.contact]."""
        found: dict[str, Range] = {}
        for name, item in self.over.items():
            found |= (
                {f"{name}.{last}": each for last, each in item.items()} if isinstance(item, dict) else {name: item}
            )
        return found
