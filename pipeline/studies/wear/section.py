"""Section [wear] of a scene: wear coefficients, duty and life."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from pipeline.scene.fields import HOURS, MOTION, Meaning, Number, Positive, Section, StudyKeys, Usual, Whole, key

MOST_COEFFICIENT = 1e-10  # m^3/J: a thousand times what is usual, a tenth of 1 mm^3/J
UNIT = "m^3/J (usual: 1e-15 to 1e-13; 1 mm^3/J is 1e-9 m^3/J)"
Coefficient = Annotated[Number, Field(ge=0.0, le=MOST_COEFFICIENT)]
LIFE = "a number above 0, {below} (give this or %s)"


class DutyPoint(Section):
    """[[wear.duty]]: an operating point; what it does not give is as in the scene."""

    share: Annotated[Number, Field(ge=0.0, le=1e15)] = key("share of the time, relative to the sum of all shares")
    engine_order: Annotated[Whole, Field(ge=0, le=100000)] | None = key(
        "engine order; none, as of force and speed: that of the scene", None
    )
    force: Positive | None = key("amplitude of the excitation, N", None)
    speed_rpm: Annotated[Number, Field(ge=0.0, le=1e6)] | None = key("speed of rotation, rev/min", None)
    frequency: Positive | None = key("excitation frequency, Hz; none: that of the followed peak", None)

    @property
    def values(self) -> dict[str, Any]:
        """Keys of the scene that it changes, with their values."""
        given = {
            "excitation.engine_order": self.engine_order,
            "excitation.force": self.force,
            "load.speed_rpm": self.speed_rpm,
        }
        return {name: value for name, value in given.items() if value is not None}


class Wear(StudyKeys):
    """[wear]: how the contact faces wear over a life. Not computed without this section."""

    coefficient: Annotated[Coefficient | dict[str, Coefficient], Meaning("m^3/J")] = key(
        "wear coefficient: volume worn off both faces together per friction work, m^3/J; a table has one for each "
        "interface that wears",
        allowed=f"a number, {{bounds}} {UNIT}, or a table of such numbers by interface",
    )
    hours: Annotated[Positive | None, HOURS] = key("the life, h", None, allowed=LIFE % "cycles")
    cycles: Positive | None = key("the life, cycles over all operating points", None, allowed=LIFE % "hours")
    duty: tuple[DutyPoint, ...] = key(
        "operating points with their shares of the time; none: that of the scene, at its peak",
        (),
        allowed="tables [[wear.duty]] with shares whose sum is above 0",
    )
    amplitude_limit: Annotated[Positive | None, MOTION] = key("amplitude whose time is told, m", None)
    depth_limit: Annotated[Positive | None, MOTION] = key(
        "worn depth of both faces together whose time is told, m; at most the length of the face", None
    )
    margin_limit: Positive | None = key(
        "least fatigue margin whose time is told, between whole responses; with [fatigue]", None
    )
    responses: Annotated[Whole, Field(ge=2, le=100)] = key(
        "times of whole responses with their worst motion: beginning, end, lowest and highest amplitude, first "
        "limit, then evenly between",
        5,
    )
    samples: Literal[16, 32, 64, 128, 256, 512] | None = key(
        "lives sampled for quantiles of the time until a limit, with coefficient_factor, [uncertainty] or both",
        None,
        allowed="16, 32, 64, 128, 256 or 512, with a limit of amplitude or depth",
    )
    coefficient_factor: Annotated[Number, Field(ge=1.0001, le=1e3)] | None = key(
        "scatter of the coefficient, lognormal: 68 % of the values within this factor",
        None,
        allowed="a number above 1, {bounds}, with samples",
    )
    seed: Annotated[Whole, Field(ge=0, le=2**63 - 1)] = key(
        "seed of the quasi-random numbers: the same seed gives the same samples", 0
    )
    tolerance: Annotated[Number, Field(ge=1e-6, le=0.1)] = key(
        "largest relative error of the interference in a step", 1e-3
    )
    area: Annotated[
        Positive | None, Meaning("m^2", usual=Usual(1e-8, 0.1, "the key is in m^2: 1 mm^2 is 1e-6 m^2", most=10.0))
    ] = key("area of a whole contact face, m^2, where the reduced model does not say it", None)

    @property
    def points(self) -> tuple[DutyPoint, ...]:
        """The operating points of the duty."""
        return self.duty or (DutyPoint(share=1.0),)
