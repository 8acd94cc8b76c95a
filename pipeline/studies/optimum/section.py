"""Section [optimum] of a scene: the keys over which the worst motion is made as low as possible."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from pipeline.scene.dotted_keys import flattened_keys
from pipeline.scene.fields import HOURS, Number, Positive, StudyKeys, key

MOST_KEYS = 6
RANGES = f"a table of 1 to {MOST_KEYS} dotted keys, each with a list of two numbers, the second above the first"
TOLERANCES = '"uncertainty", or a table of dotted keys, each with half the width: a number above 0, 1e-12 to 1e15'
Objective = Literal["displacement", "harmonic_1", "stress", "margin", "life"]
BY_STRESS = ("stress", "margin")  # objectives that need the stress on the mesh
LIFE = "life"  # that needs the wear of [wear]
Range = tuple[Number, Number]
Ranges = Annotated[dict[str, Range], Field(min_length=1, max_length=MOST_KEYS)]
Tolerances = Annotated[dict[str, Positive | dict[str, Positive | dict[str, Positive]]], Field(max_length=MOST_KEYS)]
OBJECTIVES = {  # what is made low, of a margin high
    "displacement": "largest displacement",
    "harmonic_1": "first harmonic",
    "stress": "largest stress amplitude",
    "margin": "least fatigue margin",
    LIFE: "highest amplitude over the life",
}


class Optimum(StudyKeys):
    """[optimum]: values of keys of the scene that make its worst motion lowest. Not sought without this section."""

    over: Annotated[dict[str, Range | Ranges | dict[str, Ranges]], Field(min_length=1, max_length=MOST_KEYS)] = key(
        "keys with the ranges in which they may lie", allowed=RANGES
    )

    objective: Objective = key(
        "what is made low: the largest displacement, its first harmonic, the largest stress amplitude at the worst "
        "motion, or the highest amplitude over the life of [wear]; or made high: the least fatigue margin",
        "displacement",
    )

    output: str | None = key(
        "its largest value on any branch is made low in place of the worst motion",
        None,
        allowed="the name of an [[output]] of the scene",
    )

    life: Annotated[Positive | None, HOURS] = key(
        'the life with objective = "life", h; none: that of [wear]',
        None,
        allowed='a number above 0, {below}, with "life"',
    )

    tolerance: Literal["uncertainty"] | Tolerances = key(
        "how far keys may be off: the highest worst motion within is made low; with [uncertainty] its quantile",
        {},
        allowed=TOLERANCES,
    )

    quantile: Annotated[Number, Field(ge=0.5, le=0.999)] = key(
        'the quantile of the worst motion that is made low with tolerance = "uncertainty"', 0.95
    )

    @property
    def goal(self) -> str:
        """What is made low in words."""
        return OBJECTIVES[self.objective] if self.output is None else f"largest {self.output}"

    @property
    def follows_peaks(self) -> bool:
        """Whether peaks can be followed for it."""
        return self.objective not in (*BY_STRESS, LIFE) and self.output is None

    @property
    def ranges(self) -> dict[str, Range]:
        """The range of every dotted key, also of those that stand in tables such as [optimum.over.contact]."""
        return flattened_keys(self.over)

    @property
    def tolerances(self) -> dict[str, float]:
        """The tolerance of every dotted key; none where distributions are meant."""
        return {} if self.tolerance == "uncertainty" else flattened_keys(self.tolerance)
