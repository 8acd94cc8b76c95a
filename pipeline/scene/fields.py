"""Types and texts that sections of a scene have in common, and what is known of a key beside the values it allows."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field, GetJsonSchemaHandler
from pydantic.fields import FieldInfo

if TYPE_CHECKING:
    from pydantic_core import CoreSchema


class Usual(NamedTuple):
    """Usual values of a key, what may be wrong beyond them, and the values beyond which it is wrong."""

    low: float
    high: float
    hint: str
    least: float = -math.inf
    most: float = math.inf
    any_units: bool = False  # whether it holds for matrices too, which may be in any units

    def is_usual(self, value: float) -> bool:
        """Whether a value needs no warning; 0 never does, and where no sign is unusual its size counts."""
        return value == 0.0 or self.low <= value <= self.high or (self.least < 0.0 < self.low <= -value <= self.high)

    def is_nonsense(self, value: float) -> bool:
        """Whether a value is far beyond all experience."""
        return value != 0.0 and not self.least <= value <= self.most

    @property
    def of_widths(self) -> Usual:
        """The same for differences of values: any small one is usual."""
        return Usual(0.0, self.high - min(self.low, 0.0), self.hint, 0.0, self.most - min(self.least, 0.0))


DEGREES, HERTZ = "the key is in degrees", "the key is in Hz"
PER_METRE = "the key is in N/m: 1 N/mm is 1000 N/m"


@dataclass(frozen=True)
class Meaning:
    """What is known of a key beside the values it allows, in the annotation of its field."""

    unit: str = ""  # SI unit
    symbol: str = ""  # in labels; "": the key itself
    usual: Usual | None = None
    words: str = ""  # symbols and other words that stand for it; compared without case, "_" and "-"
    shown: tuple[str, float] | None = None  # unit of labels and factor from SI; None: as all keys of its unit
    name: str = ""  # in place of the symbol where there is room
    sign: str = ""  # what a sign of its values means
    short: str = ""  # in place of the symbol where there is no room
    role: Literal["", "design", "condition"] = ""  # chosen by a designer, or met by a machine; "": as its table
    swept: bool = True  # whether it can be swept, where its table can
    nodes: Literal["scaled", "summed", "shifted"] = "scaled"  # how its values node by node follow one number
    discrete: bool = False  # no continuous way leads from one value to another one
    solver: str = ""  # parameter of the solver, over which peaks are followed; it may be drawn at random
    searched: Literal["", "decade", "static"] | tuple[float, float] = ""  # default range of an optimum
    decades: float = 0.0  # below and above the value of the scene that a knob turns through
    turned: tuple[float, float] | None = None  # range of a knob where linear responses tell none
    at_once: bool = False  # whether branches are not continued over it in steps, as over others of the solver
    uncertain: bool = False  # whether it may be drawn at random too
    formerly: Mapping[str, str] | None = None  # deprecated words with those of today


def metres(low: float, high: float, most: float, symbol: str = "", **facts: Any) -> Meaning:
    """Of a length: usual values and the largest one that is no nonsense."""
    return Meaning("m", symbol, Usual(low, high, "the key is in metres", most=most), **facts)


NOTHING_MORE = Meaning()
SMALL_LENGTH, MOTION = metres(1e-6, 0.1, 1.0), metres(1e-9, 0.1, 1.0)
HOURS = Meaning("h", usual=Usual(1e-3, 1e6, "the key is in hours", most=1e9))
STRENGTH = Meaning("Pa", usual=Usual(1e6, 1e10, "the key is in Pa: 250 MPa are 250e6", 1e4, 1e12))


def key(meaning: str, default: Any = ..., allowed: str = "", **constraints: Any) -> Any:
    """The field of a key: what it means with its unit, and what is allowed, which error messages quote.

    What is allowed is left out where the type says it, by a text in its annotation or as one number, words, true or
    false, a table. In a text stands for the constraints of the field, so that each bound is written once: `{bounds}`
    "1 to 15", `{low}` and `{high}` one of them, `{count}` "1 to 20" elements, `{words}` its words.
    """
    return Field(default, description=meaning, json_schema_extra={"allowed": allowed}, **constraints)


def optional(section: type[BaseModel], name: str) -> Any:
    """The field of a key of another section that may be left out here."""
    field = section.model_fields[name]
    return Field(None, description=field.description, json_schema_extra=field.json_schema_extra)


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


def _constraints(field: FieldInfo) -> tuple[dict[str, float], list[str]]:
    """The first bounds of a field by the name of their kind, and its words."""
    limits: dict[str, float] = {}
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
                limits.setdefault(name, value)
    return limits, words


def _in_words(field: FieldInfo) -> dict[str, str]:
    """The constraints of a field as `key` names them."""
    numbers, words = _constraints(field)
    limits = {name: _short(value) for name, value in numbers.items()}
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
    allowed = str(extra["allowed"] if isinstance(extra, dict) else "") or _of_type(field)
    return allowed.format(**_in_words(field)) if "{" in allowed else allowed


def _of_type(field: FieldInfo) -> str:
    """What the type of a field allows: as it says itself, or one number, words, or one of both."""
    if text := next((item for item in _notes(field) if isinstance(item, str)), ""):
        return text
    kinds = [get_origin(kind) or kind for kind in alternatives(field.annotation)]
    limits, words = _constraints(field)
    if words and len(kinds) > 1:
        kinds = [kind for kind in kinds if kind is not Literal]
    number = "a number above {low}, at most {high}" if "gt" in limits else "a number, {bounds}"
    text = {
        bool: "true or false",
        int: WHOLE,
        float: POSITIVE if 0.0 < limits.get("ge", 0.0) <= 1e-6 else number,
        Literal: "{words}",
    }.get(kinds[0], "a table")
    return f"{text}, or {{words}}" if words and kinds[0] is not Literal else text


def alternatives(annotation: Any) -> list[Any]:
    """The types that an annotation allows, but None."""
    if (origin := get_origin(annotation)) is Annotated:
        return alternatives(get_args(annotation)[0])
    if origin in (Union, UnionType):
        return [kind for each in get_args(annotation) for kind in alternatives(each)]
    return [] if annotation is NoneType else [annotation]


def values_for(kind: type[Any], section: BaseModel) -> dict[str, Any]:
    """The values of a section for the fields of a dataclass of another package that have the names of its keys."""
    names = [field.name for field in fields(kind) if field.name in type(section).model_fields]
    return {name: getattr(section, name) for name in names}


def meaning_in(section: type[BaseModel], name: str) -> Meaning:
    """What else is known of a key of a section."""
    return next((item for item in _notes(section.model_fields[name]) if isinstance(item, Meaning)), NOTHING_MORE)


def _notes(field: FieldInfo) -> Iterator[Any]:
    """What stands in the annotation of a field, and in those of the types that it may be of."""
    yield from field.metadata
    if get_origin(field.annotation) in (Union, UnionType):
        for kind in get_args(field.annotation):
            yield from get_args(kind)[1:] if get_origin(kind) is Annotated else ()


def bounds_in(section: type[BaseModel], name: str) -> tuple[float, float]:
    """The lowest and the highest number that a key of a section allows."""
    limits, _ = _constraints(section.model_fields[name])
    return limits["ge"], limits["le"] if "le" in limits else limits["lt"] * (1.0 - 1e-12)


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
AxisPoint = Annotated[tuple[Coordinate, Coordinate, Coordinate], "three numbers, {bounds}"]
UNIT = (
    '"m", "mm" or "in" (with kg, N, s; with t, N, s; with lbf, s), or "mm-kg-s", "mm-kg-ms", "mm-g-ms", "mm-g-s", '
    '"mm-kgf-s", "cm-g-s", "m-t-s", "in-lbf-lbm", "in-kip-s", "ft-lbf-s", "ft-lbf-lbm"'
)
# names of geometry.UNIT_SYSTEMS
# fmt: off
LengthUnit = Annotated[Literal[
    "m", "mm", "in", "mm-kg-s", "mm-kg-ms", "mm-g-ms", "mm-g-s", "mm-kgf-s", "cm-g-s", "m-t-s", "in-lbf-lbm",
    "in-kip-s", "ft-lbf-s", "ft-lbf-lbm",
], UNIT]
# fmt: on
EngineAxis = Annotated[
    Literal["x", "-x", "y", "-y", "z", "-z"] | Vector,
    '"x", "y", "z", "-x", "-y", "-z" or a list of three numbers, {bounds}, not all 0',
]

TINY = ("1e-12", "1e-9")  # lower bounds that only keep numbers from underflowing
POSITIVE = "a number above 0, {below}"
WHOLE = "a whole number, {bounds}"
AS_FIELD = "a table with mean, tilt and crown over the face"


class StudyKeys(Section):
    """Base of the sections that ask for a study, see `pipeline.studies.registry`."""
