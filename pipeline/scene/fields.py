"""Types and texts that sections of a scene have in common."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field


def key(meaning: str, allowed: str, default: Any = ..., **constraints: Any) -> Any:
    """The field of a key: what it means with its unit, and what is allowed, which error messages quote."""
    return Field(default, description=meaning, json_schema_extra={"allowed": allowed}, **constraints)


def allowed_of(section: type[BaseModel], name: str) -> str:
    """What is allowed for a key of a section."""
    extra = section.model_fields[name].json_schema_extra
    return str(extra["allowed"]) if isinstance(extra, dict) else ""


Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Whole = Annotated[int, Field(strict=True)]
Truth = Annotated[bool, Field(strict=True)]
# The bounds only keep squares and products of mistyped numbers from over- and underflowing.
Positive = Annotated[Number, Field(ge=1e-12, le=1e15)]
NotNegative = Annotated[Number, Field(ge=0.0, le=1e15)]
Length = Annotated[Number, Field(ge=1e-6, le=1e3)]
Distance = Annotated[Number, Field(ge=-1e3, le=1e3)]
Distances = Annotated[tuple[Distance, ...], Field(min_length=1)]
Positives = Annotated[tuple[NotNegative, ...], Field(min_length=1)]
Ratio = Annotated[Number, Field(ge=1e-12, lt=1.0)]
Vector = tuple[Distance, Distance, Distance]
# of files from other programs: in any unit of length
Coordinate = Annotated[Number, Field(ge=-1e6, le=1e6)]
AxisPoint = tuple[Coordinate, Coordinate, Coordinate]
# names of geometry.UNIT_SYSTEMS
# fmt: off
LengthUnit = Literal[
    "m", "mm", "in", "mm-kg-s", "mm-kg-ms", "mm-g-ms", "mm-g-s", "mm-kgf-s", "cm-g-s", "m-t-s", "in-lbf-lbm",
    "in-kip-s", "ft-lbf-s", "ft-lbf-lbm",
]
# fmt: on
EngineAxis = Literal["x", "-x", "y", "-y", "z", "-z"] | Vector

POSITIVE = "a number above 0, 1e-12 to 1e15"
LENGTH = "a number above 0, 1e-6 to 1000"
FILLET = "a number, 0 to 10"
BLADES = "a whole number, 3 to 10000"
UNIT = (
    '"m", "mm" or "in" (with kg, N, s; with t, N, s; with lbf, s), or "mm-kg-s", "mm-kg-ms", "mm-g-ms", "mm-g-s", '
    '"mm-kgf-s", "cm-g-s", "m-t-s", "in-lbf-lbm", "in-kip-s", "ft-lbf-s", "ft-lbf-lbm"'
)
AXIS = '"x", "y", "z", "-x", "-y", "-z" or a list of three numbers, -1000 to 1000, not all 0'
AXIS_POINT = "three numbers, -1e6 to 1e6"
STIFFNESS = (
    "a number, 0 to 1e15 (whole face, shared by the nodes as their areas), a list of such numbers node by node, "
    'or "punch"'
)


class Section(BaseModel):
    """Base of all sections: unknown keys are refused, values are frozen. Its validator is built when first used."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)


class StudyKeys(Section):
    """Base of the sections that ask for a study, see `pipeline.studies.registry`."""
