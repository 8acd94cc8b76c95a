"""[contact] and [interface.NAME] of a scene: law and integration of all contacts, parameters of each interface."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from pipeline.scene.fields import STIFFNESS, Distance, Distances, NotNegative, Positives, Section, Whole, key

Stiffness = Literal["punch"] | NotNegative | Positives
NODE_BY_NODE = "a number, {bounds}, or a list of such numbers node by node"
_MEANINGS = {
    "normal_stiffness": "kn, N/m",
    "tangential_stiffness": "kt, N/m",
    "friction": "friction coefficient",
    "interference": "v0, m: above 0 pressed together, below 0 a gap",
    "preload": "N0, N for each node (a number: on average): normal load already in equilibrium",
}
PER_NODE = tuple(_MEANINGS)  # keys that an interface may have of its own


class Contact(Section):
    """[contact]: springs, friction and interference of the contact nodes."""

    normal_stiffness: Stiffness = key(_MEANINGS["normal_stiffness"], STIFFNESS)
    tangential_stiffness: Stiffness = key(_MEANINGS["tangential_stiffness"], STIFFNESS)
    friction: NotNegative | Positives = key(_MEANINGS["friction"], NODE_BY_NODE)
    interference: Distance | Distances = key(_MEANINGS["interference"], NODE_BY_NODE, 0.0)
    preload: NotNegative | Positives = key(_MEANINGS["preload"], NODE_BY_NODE, 0.0)
    law: Literal["two_sliders", "cone"] = key(
        "one slider along t1 and one along t2, or one slider in the plane", "{words}", "two_sliders"
    )
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


class Interface(Section):
    """[interface.NAME]: contact parameters of one interface; those left out are as in [contact]."""

    normal_stiffness: Stiffness | None = key(_MEANINGS["normal_stiffness"], STIFFNESS, None)
    tangential_stiffness: Stiffness | None = key(_MEANINGS["tangential_stiffness"], STIFFNESS, None)
    friction: NotNegative | Positives | None = key(_MEANINGS["friction"], NODE_BY_NODE, None)
    interference: Distance | Distances | None = key(_MEANINGS["interference"], NODE_BY_NODE, None)
    preload: NotNegative | Positives | None = key(_MEANINGS["preload"], NODE_BY_NODE, None)

    @property
    def given(self) -> dict[str, Any]:
        """The values that are given, by key."""
        found: dict[str, Any] = self.model_dump(exclude_none=True)
        return found
