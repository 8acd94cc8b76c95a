"""[aero] of a scene: aerodynamic influence coefficients of mode families."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from pipeline.scene.fields import Number, Section, Whole, key

Coefficient = Annotated[Number, Field(ge=-1.0, le=1.0)]
Places = Annotated[tuple[Annotated[Whole, Field(ge=-10000, le=10000)], ...], Field(min_length=1, max_length=10000)]
VALUES = "a list of numbers, -1 to 1, one for each offset or nodal diameter"


class AeroFamily(Section):
    """[[aero.family]]: aerodynamic influence coefficients of one mode family, or their sums for each wave."""

    mode: Whole = key("number of the mode with free contacts in its wave", "a whole number, {bounds}", ge=1, le=100)
    offset: Places | None = key(
        "places from the blade that feels the force to the one that moves, in +y", "a list of whole numbers", None
    )
    nodal_diameter: Places | None = key(
        "in place of offset: nodal diameters of the waves, above 0 backward, each one of the ring",
        "a list of whole numbers (give this or offset)",
        None,
    )
    real: tuple[Coefficient, ...] = key(
        "modal force over modal displacement and the square of the natural frequency, in phase with the displacement",
        VALUES,
    )
    imaginary: tuple[Coefficient, ...] = key(
        "the same ahead of the displacement by a quarter of a period: above 0 the flow feeds the vibration", VALUES
    )


class Aero(Section):
    """[aero]: the flow around the blades, as forces on their modes."""

    family: Annotated[tuple[AeroFamily, ...], Field(min_length=1)] = key(
        "mode families that the flow acts on", "tables [[aero.family]] with different modes"
    )
