"""[contact] and [interface.NAME] of a scene: integration of all contacts, law and parameters of each interface."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from pipeline.scene.fields import (
    AS_FIELD,
    STIFFNESS,
    Distance,
    Distances,
    NotNegative,
    Number,
    Positives,
    Section,
    Whole,
    key,
)

Coefficient = Annotated[Number, Field(ge=-1e15, le=1e15)]
Coefficients = tuple[Coefficient, Coefficient]
NODE_BY_NODE = f"a number, {{bounds}}, a list of such numbers node by node, or {AS_FIELD}"
TWO = "two numbers, along t1 and t2, -1e15 to 1e15"


class FaceField(Section):
    """A quantity as a polynomial over the face, mean + tilt . (x, y) + crown . (1/3 - x^2, 1/3 - y^2).

    x along t1 and y along t2 have the mean 0 and the mean square 1/3: on a rectangle they run from -1 to 1.
    """

    mean: Coefficient = key("mean over the face", "a number, {bounds}")
    tilt: Coefficients = key("change from the middle of the face to its edges along t1 and t2", TWO, (0.0, 0.0))
    crown: Coefficients = key("by how much the middle is above the edges along t1 and t2", TWO, (0.0, 0.0))

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


Stiffness = Literal["punch"] | NotNegative | Positives | FaceField
_MEANINGS = {
    "normal_stiffness": "kn, N/m",
    "tangential_stiffness": "kt, N/m",
    "friction": "friction coefficient",
    "interference": "v0, m: above 0 pressed together, below 0 a gap",
    "preload": "N0, N for each node (a number: on average): normal load already in equilibrium",
}
PER_NODE = tuple(_MEANINGS)  # keys with a value for each contact node
OF_INTERFACE = (*PER_NODE, "law")  # keys that an interface may have of its own
_LAW = "one slider along t1 and one along t2, or one slider in the plane"
Law = Literal["two_sliders", "cone"]


class Contact(Section):
    """[contact]: springs, friction and interference of the contact nodes."""

    normal_stiffness: Stiffness = key(_MEANINGS["normal_stiffness"], STIFFNESS)
    tangential_stiffness: Stiffness = key(_MEANINGS["tangential_stiffness"], STIFFNESS)
    friction: NotNegative | Positives | FaceField = key(_MEANINGS["friction"], NODE_BY_NODE)
    interference: Distance | Distances | FaceField = key(_MEANINGS["interference"], NODE_BY_NODE, 0.0)
    preload: NotNegative | Positives | FaceField = key(_MEANINGS["preload"], NODE_BY_NODE, 0.0)
    law: Law = key(_LAW, "{words}", "two_sliders")
    integration: Literal["exact", "sampled"] = key(
        "how a period is integrated: from event to event or at equal instants", "{words}", "exact"
    )
    samples: Whole = key(
        "instants of a period where it is sampled", "a whole number, {bounds}", 1024, ge=16, le=65536
    )
    interfaces: Annotated[tuple[str, ...], Field(min_length=1)] | None = key(
        "contact interfaces that touch; by default all that the model has",
        "a list of names of interfaces, one or more",
        None,
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

    normal_stiffness: Stiffness | None = key(_MEANINGS["normal_stiffness"], STIFFNESS, None)
    tangential_stiffness: Stiffness | None = key(_MEANINGS["tangential_stiffness"], STIFFNESS, None)
    friction: NotNegative | Positives | FaceField | None = key(_MEANINGS["friction"], NODE_BY_NODE, None)
    interference: Distance | Distances | FaceField | None = key(_MEANINGS["interference"], NODE_BY_NODE, None)
    preload: NotNegative | Positives | FaceField | None = key(_MEANINGS["preload"], NODE_BY_NODE, None)
    law: Law | None = key(_LAW, "{words}", None)

    @property
    def given(self) -> dict[str, Any]:
        """The values that are given, by key."""
        return {name: value for name in OF_INTERFACE if (value := getattr(self, name)) is not None}
