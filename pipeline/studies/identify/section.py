"""Section [identify] of a scene: the parameters that measured peaks and response curves are to give."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, ValidationInfo, field_validator

from pipeline.scene.dotted_keys import flattened_keys
from pipeline.scene.fields import Meaning, Number, Positive, Section, StudyKeys, Whole, key
from pipeline.scene.loads_section import File
from pipeline.studies.optimum.section import MOST_KEYS, RANGES, Range, Ranges

MOST_MEASURED = 2000
CONDITIONS = "a table of dotted keys of the scene, each with one value"
CANDIDATES = "a table of dotted keys of the scene, each with a list of 1 to 20 values"
Frequency = Annotated[Number, Field(ge=1e-9, le=1e9)]
Rate = Annotated[Number, Field(ge=-1e9, le=1e9)]
Share = Annotated[Number, Field(ge=1e-6, le=1.0)]


class MeasuredMotion(Section):
    """[[identify.measured]]: a measured peak, or a point of a measured response curve."""

    frequency: Annotated[Frequency, Meaning("Hz")] = key("excitation frequency, Hz")
    amplitude: Positive = key("amplitude of the vibration about its mean, m; of a strain m/m")
    output: str | None = key(
        "name of the [[output]] that was measured; none: the default output",
        None,
        allowed="the name of an [[output]] that is a strain or has a direction",
    )
    curve: str | None = key(
        "name of the curve that it is a point of; none: it is a peak",
        None,
        allowed="text of 1 to 100 characters",
        min_length=1,
        max_length=100,
    )
    amplitude_deviation: Annotated[Share, Field()] | None = key(
        "standard deviation relative to the amplitude; none: that of [identify]", None
    )
    frequency_deviation: Annotated[Positive | None, Meaning("Hz")] = key(
        "standard deviation of the frequency of a peak, Hz; none: that of [identify]",
        None,
        allowed="a number above 0, of a peak",
    )
    rate: Rate | None = key(
        "rate of the sweep that has the peak, Hz/s, below 0 downwards; none: steady",
        None,
        allowed="a number, -1e9 to 1e9 and not 0, of a peak",
    )
    at: dict[str, Any] = key(
        "values of keys while it was measured; all others are those of the scene", {}, CONDITIONS
    )

    @field_validator("rate")
    @classmethod
    def _of_a_peak(cls, value: Any, info: ValidationInfo) -> Any:
        if value is not None and (value == 0.0 or info.data.get("curve") is not None):
            raise ValueError("a number, -1e9 to 1e9 and not 0, of a peak")
        return value

    @field_validator("frequency_deviation")
    @classmethod
    def _frequency_of_a_peak(cls, value: Any, info: ValidationInfo) -> Any:
        if value is not None and info.data.get("curve") is not None:
            raise ValueError("a number above 0, of a peak")
        return value

    @property
    def conditions(self) -> dict[str, Any]:
        """The values of keys, dotted."""
        return flattened_keys(self.at)


class Identify(StudyKeys):
    """[identify]: values of keys with which the scene vibrates as was measured. Not sought without this section."""

    over: Annotated[dict[str, Range | Ranges | dict[str, Ranges]], Field(min_length=1, max_length=MOST_KEYS)] = key(
        "keys with the ranges in which they may lie, each value as likely; of a range above 0 that spans more than a "
        "factor of 4 each factor",
        allowed=RANGES,
    )
    data: File | None = key("measured motions, a row each, or a universal file with curves", None)
    measured: Annotated[tuple[MeasuredMotion, ...], Field(max_length=MOST_MEASURED)] = key(
        "measured motions beside those of data", (), allowed="tables [[identify.measured]], 2000 at most"
    )
    amplitude_deviation: Share = key(
        "standard deviation of an amplitude relative to it, errors of the model included", 0.05
    )
    frequency_deviation: Share = key(
        "standard deviation of the frequency of a peak relative to it, errors of the model included", 0.002
    )
    scouts: Annotated[Whole, Field(ge=4, le=1024)] | None = key(
        "places in the ranges whose responses are solved first; none: 8 for each key, 32 at most", None
    )
    candidates: dict[str, Any] = key(
        "measurements that could come next; none: four times the force, and a quarter of it", {}, allowed=CANDIDATES
    )

    def placed(self, folder: Path) -> Identify:
        """The section with the full path of its file."""
        data = None if self.data is None else os.path.abspath(folder / self.data)
        return self.model_copy(update={"data": data})

    @property
    def places(self) -> int:
        """Places whose responses are solved first."""
        return self.scouts or min(8 * len(self.ranges), 32)

    @property
    def ranges(self) -> dict[str, Range]:
        """The range of every dotted key."""
        return flattened_keys(self.over)
