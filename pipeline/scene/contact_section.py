"""[contact] and [interface.NAME] of a scene: integration of all contacts, law and parameters of each interface."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from pipeline.scene.fields import (
    AS_FIELD,
    PER_METRE,
    Distance,
    Distances,
    Meaning,
    NotNegative,
    Number,
    Positives,
    Section,
    Usual,
    Whole,
    key,
    meaning_in,
    optional,
)

Coefficient = Annotated[Number, Field(ge=-1e15, le=1e15)]
Coefficients = Annotated[tuple[Coefficient, Coefficient], "two numbers, along t1 and t2, -1e15 to 1e15"]


class FaceField(Section):
    """A quantity as a polynomial over the face, mean + tilt . (x, y) + crown . (1/3 - x^2, 1/3 - y^2).

    x along t1 and y along t2 have the mean 0 and the mean square 1/3: on a rectangle they run from -1 to 1.
    """

    mean: Coefficient = key("mean over the face, in the unit of the quantity: of stiffnesses that of the whole face")
    tilt: Coefficients = key("change from the middle of the face to its edges along t1 and t2", (0.0, 0.0))
    crown: Coefficients = key("by how much the middle is above the edges along t1 and t2", (0.0, 0.0))

    @property
    def ends(self) -> tuple[float, float]:
        """The lowest and the highest value on a rectangle."""
        low = high = self.mean
        for tilt, crown in zip(self.tilt, self.crown, strict=True):
            places = [-1.0, 1.0, *([tilt / (2.0 * crown)] if abs(tilt) < 2.0 * abs(crown) else [])]
            values = [tilt * x + crown * (1.0 / 3.0 - x * x) for x in places]
            low, high = low + min(values), high + max(values)
        return low, high

    def with_mean(self, mean: float, factor: float) -> dict[str, Any]:
        """The table of a field with another mean, tilt and crown multiplied by a factor."""
        return {"mean": mean, **{name: [factor * c for c in getattr(self, name)] for name in ("tilt", "crown")}}


def mean_of(value: Any) -> Any:
    """The mean of a field over the face; other values as they are."""
    return value.mean if isinstance(value, FaceField) else value


OVER_FACE = f"a number, {{bounds}}, a list of such numbers node by node, or {AS_FIELD}"
OverFace = Annotated[NotNegative | Positives | FaceField, OVER_FACE]
Overlap = Annotated[Distance | Distances | FaceField, OVER_FACE]
Stiffness = Annotated[
    Literal["punch"] | NotNegative | Positives | FaceField,
    "a number, {bounds} (whole face, shared by the nodes as their areas), a list of such numbers node by node, "
    f'{AS_FIELD}, or "punch"',
]
_SPRING = Meaning(
    "N/m", usual=Usual(1e3, 1e12, PER_METRE), shown=("N/µm", 1e-6), nodes="summed", searched="decade", decades=2.0
)
Law = Literal["two_sliders", "cone"]


class Contact(Section):
    """[contact]: springs, friction and interference of the contact nodes."""

    normal_stiffness: Annotated[
        Stiffness, replace(_SPRING, symbol="kn", words="kn stiffness", solver="normal_stiffness")
    ] = key("normal stiffness kn, N/m")
    tangential_stiffness: Annotated[
        Stiffness, replace(_SPRING, symbol="kt", words="kt", solver="tangential_stiffness")
    ] = key("tangential stiffness kt, N/m")
    friction: Annotated[
        OverFace,
        Meaning(
            symbol="friction coefficient",
            usual=Usual(0.0, 2.0, "a friction coefficient is 0.1 to 1 or so", most=10.0, any_units=True),
            words="mu frictioncoefficient coefficientoffriction",
            short="mu",
            solver="friction",
            role="condition",
            searched=(0.05, 1.0),
            turned=(0.0, 1.0),
        ),
    ] = key("friction coefficient")
    interference: Annotated[
        Overlap,
        Meaning(
            "m",
            "v0",
            Usual(-0.001, 0.001, "the key is in metres: 1e-6 is 1 um, above 0 pressed together", -0.05, 0.05),
            words="v0 gap initialgap",
            shown=("µm", 1e6),
            name="interference v0",
            sign="gap below 0",
            short="v0",
            solver="interference",
            role="design",
            nodes="shifted",
            searched="static",
            turned=(-1e-4, 1e-4),
        ),
    ] = key("v0, m: above 0 pressed together, below 0 a gap", 0.0)
    preload: Annotated[
        OverFace,
        Meaning(
            "N",
            "preload",
            Usual(0.0, 1e6, "the key is in N for each node"),
            words="n0 normalload",
            solver="preload",
            role="design",
            searched="static",
            turned=(0.0, 100.0),
        ),
    ] = key("N0, N for each node (a number: on average): normal load already in equilibrium", 0.0)
    law: Annotated[Law, Meaning(formerly={"uncoupled": "two_sliders", "coupled": "cone"})] = key(
        "one Jenkins element along t1 and one along t2, or one slider in the plane with the circular friction cone",
        "two_sliders",
    )
    integration: Literal["exact", "sampled"] = key(
        "how a period is integrated: from event to event or at equal instants", "exact"
    )
    samples: Whole = key("instants of a period where it is sampled, at least 4 harmonics + 4", 1024, ge=16, le=65536)
    interfaces: Annotated[Annotated[tuple[str, ...], Field(min_length=1)] | None, Meaning(swept=False)] = key(
        "contact interfaces that touch, the others are taken out of the model; by default all",
        None,
        allowed="a list of names of interfaces, one or more",
    )

    @field_validator("interfaces")
    @classmethod
    def _each_once(cls, value: Any) -> Any:
        return value if value is None else tuple(dict.fromkeys(value))

    @property
    def uses_punch(self) -> bool:
        """Whether a contact stiffness is to be computed from the area of the face, as of a rigid flat punch."""
        return "punch" in (self.normal_stiffness, self.tangential_stiffness)


# of a scene without [contact], for a mesh without contact faces: no key of it is given, no number acts
NO_TABLE = Contact.model_construct(set(), normal_stiffness=1e5, tangential_stiffness=1e5, friction=0.3)


def contact_unless_of_a_file(tables: Any) -> Any:
    """The tables of a scene, with an empty [contact] where it is missing and no mesh file may be without contact."""
    if not isinstance(tables, Mapping) or "contact" in tables:
        return tables
    mesh = tables.get("mesh")
    return tables if isinstance(mesh, Mapping) and "file" in mesh else {**tables, "contact": {}}


class Interface(Section):
    """[interface.NAME]: contact parameters of one interface; those left out are as in [contact]."""

    normal_stiffness: Stiffness | None = optional(Contact, "normal_stiffness")
    tangential_stiffness: Stiffness | None = optional(Contact, "tangential_stiffness")
    friction: OverFace | None = optional(Contact, "friction")
    interference: Overlap | None = optional(Contact, "interference")
    preload: OverFace | None = optional(Contact, "preload")
    law: Law | None = optional(Contact, "law")

    @property
    def given(self) -> dict[str, Any]:
        """The values that are given, by key."""
        return {name: value for name in OF_INTERFACE if (value := getattr(self, name)) is not None}


# keys with a value for each contact node
PER_NODE = tuple(name for name in Interface.model_fields if meaning_in(Contact, name).solver)
OF_INTERFACE = tuple(Interface.model_fields)  # keys that an interface may have of its own
