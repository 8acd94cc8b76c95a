"""Types and texts that sections of a scene have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field, GetJsonSchemaHandler
from pydantic.fields import FieldInfo

if TYPE_CHECKING:
    from pydantic_core import CoreSchema


def key(meaning: str, allowed: str, default: Any = ..., **constraints: Any) -> Any:
    """The field of a key: what it means with its unit, and what is allowed, which error messages quote.

    In the text of what is allowed stands for the constraints of the field, so that each bound is written once:
    `{bounds}` "1 to 15", `{low}` and `{high}` one of them, `{count}` "1 to 20" elements, `{words}` its words.
    """
    return Field(default, description=meaning, json_schema_extra={"allowed": allowed}, **constraints)


class Section(BaseModel):
    """Base of all sections: unknown keys are refused, values are frozen. Its validator is built when first used."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """The JSON schema with what is allowed for each key, its constraints put in."""
        found = handler(core)
        for name, value in handler.resolve_ref_schema(found)["properties"].items():
            value["allowed"] = allowed_of(cls, name)
        return found


def _constraints(field: FieldInfo) -> dict[str, str]:
    """The constraints of a field in words, as `key` names them."""
    limits: dict[str, Any] = {}
    words: list[str] = []
    waiting: list[Any] = [*field.metadata, field.annotation]
    while waiting:
        item = waiting.pop(0)
        if isinstance(item, FieldInfo):
            waiting[:0] = item.metadata
        elif get_origin(item) is Literal:
            words += [f'"{word}"' for word in get_args(item)]
        elif get_origin(item) is not None:
            waiting += get_args(item)  # of Annotated its metadata too
        for name in ("ge", "gt", "le", "lt", "min_length", "max_length"):
            if (value := getattr(item, name, None)) is not None:
                limits.setdefault(name, _short(value))
    low, high = limits.get("ge", limits.get("gt", "")), limits.get("le", limits.get("lt", ""))
    return {
        "low": low,
        "high": high,
        "bounds": f"{low} to {high}",
        "below": f"at most {high}" if low in TINY else f"{low} to {high}",  # behind "above 0"
        "count": f"{limits.get('min_length', '')} to {limits.get('max_length', '')}",
        "words": " or ".join(filter(None, (", ".join(words[:-1]), *words[-1:]))),
    }


def _short(value: float) -> str:
    """A bound as a user would write it: 1e15, 1000, 0.5."""
    if isinstance(value, int):
        return str(value)
    return f"{value:g}".replace("e+0", "e").replace("e+", "e").replace("e-0", "e-")


def allowed_of(section: type[BaseModel], name: str) -> str:
    """What is allowed for a key of a section."""
    field = section.model_fields[name]
    extra = field.json_schema_extra
    allowed = str(extra["allowed"]) if isinstance(extra, dict) else ""
    return allowed.format(**_constraints(field)) if "{" in allowed else allowed


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
LEAST_DAMPING = 1e-9  # below, a resonance is lost in round-off
Ratio = Annotated[Number, Field(ge=LEAST_DAMPING, lt=1.0)]
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

TINY = ("1e-12", "1e-9")  # lower bounds that only keep numbers from underflowing
POSITIVE = "a number above 0, {below}"
LENGTH = POSITIVE
FILLET = "a number, {bounds}"
BLADES = "a whole number, {bounds}"
UNIT = (
    '"m", "mm" or "in" (with kg, N, s; with t, N, s; with lbf, s), or "mm-kg-s", "mm-kg-ms", "mm-g-ms", "mm-g-s", '
    '"mm-kgf-s", "cm-g-s", "m-t-s", "in-lbf-lbm", "in-kip-s", "ft-lbf-s", "ft-lbf-lbm"'
)
AXIS = '"x", "y", "z", "-x", "-y", "-z" or a list of three numbers, {bounds}, not all 0'
AXIS_POINT = "three numbers, {bounds}"
AS_FIELD = "a table with mean, tilt and crown over the face"
STIFFNESS = (
    "a number, {bounds} (whole face, shared by the nodes as their areas), a list of such numbers node by node, "
    f'{AS_FIELD}, or "punch"'
)


class StudyKeys(Section):
    """Base of the sections that ask for a study, see `pipeline.studies.registry`."""
