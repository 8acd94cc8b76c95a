"""Section [run_up] of a scene: the response while the excitation frequency rises or falls at a given rate."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo, field_validator

from pipeline.scene.fields import Meaning, Number, Positive, Section, StudyKeys, Whole, key
from pipeline.studies.backbone.section import Curves

RATES = "a list of 1 to 20 different numbers above 0, 1e-9 to 1e9"
Rates = Annotated[tuple[Annotated[Number, Field(ge=1e-9, le=1e9)], ...], Field(min_length=1, max_length=20)]
Angle = Annotated[Number, Field(ge=0.0, le=360.0)]
Seconds = Annotated[Number, Field(ge=0.0, le=1.0)]
Frequency = Annotated[Number, Field(ge=1e-9, le=1e9)]


class Probes(Section):
    """[run_up.probes]: probes of the casing that the tips of the blades pass (blade-tip timing)."""

    angles: Annotated[tuple[Angle, ...], Field(min_length=1, max_length=64)] = key(
        "of the probes in the direction of rotation, degrees from blade 0 at rest",
        allowed="a list of 1 to 64 different numbers, 0 to 360",
    )
    radius: Annotated[Positive | None, Meaning("m")] = key(
        "of the tips, m; none: that of the blade of the scene", None
    )
    blades: Whole = key("blades whose passages are read, from blade 0 on", 1, ge=1, le=1000)
    resolution: Annotated[Seconds, Meaning("s")] = key("of the timer, s", 0.0)
    noise: Annotated[Seconds, Meaning("s")] = key("standard deviation of the time of a passage, s", 0.0)
    seed: Whole = key("seed of the noise", 0, ge=0, le=2**53 - 1)

    @field_validator("angles")
    @classmethod
    def _different(cls, value: Any) -> Any:
        if len({angle % 360.0 for angle in value}) < len(value):
            raise ValueError("a list of 1 to 64 different numbers, 0 to 360")
        return value


class RunUp(StudyKeys):
    """[run_up]: the ring of blades in sweeps of the excitation. Not computed without this section."""

    rate: Rates | None = key("rates of the excitation frequency (Hz/s)", None, allowed=RATES)
    speed_rate: Rates | None = key(
        "rates of the speed in place of it (rev/min a second): times the engine order over 60",
        None,
        allowed=f"{RATES} (give this or rate)",
        validate_default=True,
    )
    direction: Literal["both", "up", "down"] = key("way of the sweeps", "both")
    frequency: Annotated[tuple[Frequency, Frequency] | None, Meaning("Hz")] = key(
        "ends of the sweeps, Hz; none: those of the curve",
        None,
        allowed="a list of two numbers, 1e-9 to 1e9, the second above the first, within the frequencies of the curve",
    )
    output: str | None = key(
        "name of an [[output]] with one component whose envelope is shown, such as the strain of a gauge; none: the "
        "default output",
        None,
        allowed="the name of an [[output]] that is a strain or has a direction",
    )
    probes: Probes | None = key("blade-tip timing of the output, a displacement along the circumference", None)
    curves: Literal["all"] | Curves = key(
        '"all", or the numbers of curves from 0',
        "all",
        allowed='"all" or a list of 1 to 100 numbers of curves, the first is 0',
    )

    @field_validator("speed_rate")
    @classmethod
    def _one_kind(cls, value: Any, info: ValidationInfo) -> Any:
        if "rate" in info.data and (value is None) == (info.data["rate"] is None):
            raise ValueError(f"{RATES} (give this or rate)")
        return value

    def rates_hz(self, engine_order: int) -> tuple[float, ...]:
        """The rates of the excitation frequency, Hz/s."""
        return self.rate or tuple(rate * engine_order / 60.0 for rate in self.speed_rate or ())
