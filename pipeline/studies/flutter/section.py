"""Section [flutter] of a scene: limit cycles of the waves that the flow feeds."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from pipeline.scene.fields import Number, StudyKeys, Whole, key
from pipeline.studies.backbone.section import Curves

DIAMETERS = "a list of 1 to 1000 different whole numbers, -100000 to 100000"
Diameters = Annotated[
    tuple[Annotated[Whole, Field(ge=-100000, le=100000)], ...], Field(min_length=1, max_length=1000)
]


class Flutter(StudyKeys):
    """[flutter]: motions of the ring without excitation, in the flow of [aero]. Not computed without this section."""

    mode: Whole = key("number of the mode, 1 is the lowest at small amplitudes", 1, ge=1, le=1000)
    nodal_diameters: Diameters | None = key(
        "waves, above 0 backward; none: those that flutter with free, sliding or stuck contacts",
        None,
        allowed=DIAMETERS,
    )
    harmonics: Whole | None = key("number of harmonics; none: that of the curve", None, ge=1, le=25)
    reach: Number = key(
        "largest amplitude, over that at which a contact node first slips, lifts off or touches",
        3000.0,
        ge=2.0,
        le=1e6,
    )
    curves: Literal["all"] | Curves = key(
        '"all", or the numbers of curves from 0',
        "all",
        allowed='"all" or a list of 1 to 100 numbers of curves, the first is 0',
    )
    periods: Whole = key(
        "most periods of the ring in time, from a small disturbance of all waves until the motion settles or grows "
        "for ever; 0: not integrated",
        0,
        ge=0,
        le=100_000,
    )
    disturbance: Number = key(
        "size of that disturbance, over that at which a node first slips, lifts off or touches",
        0.5,
        gt=0.0,
        le=1e4,
    )
    in_time: Curves | None = key(
        "curves whose ring is integrated in time; none: the first of `curves`",
        None,
        allowed="a list of 1 to 100 numbers of curves, the first is 0",
    )
