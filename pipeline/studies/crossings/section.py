"""Section [crossings] of a scene: every resonance of the engine orders over a range of speeds."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from pipeline.scene.dotted_keys import flattened_keys
from pipeline.scene.fields import MOTION, Meaning, Number, Positive, StudyKeys, key

Speed = Annotated[Number, Field(ge=0.0, le=1e6)]
Steady = Annotated[tuple[Annotated[Number, Field(ge=1e-3, le=1e6)], ...], Field(max_length=20)]
Factor = Annotated[Number, Field(ge=0.0, le=10.0)]
RPM = Meaning("rev/min")
SPEED = "a list of two numbers, 0 to 1e6, the second above the first"
TOLERANCE = (
    "a table of at most 6 dotted keys of contact, excitation.force or response.damping_ratio, each with half the "
    "width: a number above 0, 1e-12 to 1e15"
)
FACTOR = "a list of two numbers, 0 to 10, with a table [load.temperature]"


class Crossings(StudyKeys):
    """[crossings]: the table of all resonance crossings. Not computed without this section."""

    speed: Annotated[tuple[Speed, Speed], RPM] = key(
        "lowest and highest speed of the machine, rev/min; crossings up to 5 % beside are computed too", allowed=SPEED
    )
    steady: Annotated[Steady, RPM] = key(
        "speeds at which the machine runs for long, rev/min: the distance of a crossing is that from the nearest; "
        "none: the ends of `speed`",
        (),
        allowed="a list of at most 20 numbers, 1e-3 to 1e6",
    )
    temperature_factor: tuple[Factor, Factor] | None = key(
        "load.temperature_factor at the ends of `speed`, linear between; none: that of [load]", None, allowed=FACTOR
    )
    least: Annotated[Number, Field(ge=0.0, le=1.0)] = key(
        "modes whose linear resonance is lower than this share of the highest of their engine order are left out",
        1e-3,
    )
    limit: Annotated[Positive | None, MOTION] = key(
        "amplitude, m: the probability that the worst motion exceeds it is given; needs [uncertainty]", None
    )
    margin: Positive | None = key(
        "fatigue margin: the probability that a crossing has less is given, with the stress in proportion to the "
        "motion; needs [uncertainty] and [fatigue]",
        None,
    )
    tolerance: Annotated[dict[str, Positive | dict[str, Positive | dict[str, Positive]]], Field(max_length=6)] = key(
        "how far keys may be off: the change of the worst motion within", {}, allowed=TOLERANCE
    )

    @property
    def tolerances(self) -> dict[str, float]:
        """The tolerance of every dotted key, also of those that stand in tables."""
        return flattened_keys(self.tolerance)
