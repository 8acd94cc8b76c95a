"""Section [map] of a scene: two keys, over a grid of which the worst motion is mapped."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field, field_validator

from pipeline.scene.dotted_keys import flattened_keys
from pipeline.scene.fields import Number, StudyKeys, Whole, key

OVER = (
    "a table of two dotted keys, each with [low, high] or with three to 200 ascending numbers, which are the values "
    "themselves"
)
COUNT = "a whole number, 3 to 200, or two of them, one for each key"
LOGARITHMIC = "a list of keys of `over` whose numbers are above 0"
Count = Annotated[Whole, Field(ge=3, le=200)]
Values = Annotated[tuple[Number, ...], Field(min_length=2, max_length=200)]


class Map(StudyKeys):
    """[map]: worst motion over two keys. Not computed unless this section is there."""

    over: Annotated[dict[str, Values], Field(min_length=2, max_length=2)] = key(
        "the two keys, columns first", allowed=OVER
    )
    values: Count | tuple[Count, Count] = key("number of values of each range", 15, allowed=COUNT)
    logarithmic: tuple[str, ...] = key("keys whose range is divided evenly in its logarithm", (), allowed=LOGARITHMIC)
    refine: Whole = key("how often cells of the grid are halved where they are not resolved", 0, ge=0, le=4)
    tolerance: Number = key(
        "relative error of the interpolated amplitude above which a cell is halved", 0.05, ge=0.001, le=1.0
    )

    @field_validator("over", mode="before")
    @classmethod
    def _dotted(cls, value: Any) -> Any:
        """Keys as dotted keys, also where they stand in tables such as [map.over.contact]."""
        return flattened_keys(value) if isinstance(value, Mapping) else value
