"""Section [mistuning] of a scene: blades and contact pairs that differ around the ring."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from pipeline.scene.fields import Meaning, Number, Positive, StudyKeys, Whole, key, metres

DEVIATIONS = "a list of numbers, -0.5 to 0.5, one for each blade of the ring"
Spread = Annotated[Number, Field(ge=0.0, le=0.1)]
WideSpread = Annotated[Number, Field(ge=0.0, le=0.2)]


class Mistuning(StudyKeys):
    """[mistuning]: response of rings whose blades differ. Not computed without this section."""

    frequency: Annotated[tuple[Annotated[Number, Field(ge=-0.5, le=0.5)], ...], Field(min_length=1)] | None = key(
        "relative deviation of the natural frequencies of each blade, clamped (on a disk: at the rim) and free; "
        "none: drawn at random",
        None,
        allowed=DEVIATIONS,
    )
    frequency_deviation: Spread = key("standard deviation of these where they are drawn at random, relative", 0.01)
    friction_deviation: WideSpread = key(
        "standard deviation of the friction coefficient from pair to pair, relative", 0.0
    )
    stiffness_deviation: WideSpread = key(
        "standard deviation of the contact stiffnesses from pair to pair, relative", 0.0
    )
    interference_deviation: Annotated[Annotated[Number, Field(ge=0.0, le=1.0)], metres(0.0, 0.001, 0.05)] = key(
        "standard deviation of the interference from pair to pair, m", 0.0
    )
    samples: Whole = key("rings whose nonlinear response is computed; one where nothing is drawn", 10, ge=1, le=1000)
    linear_samples: Whole = key(
        "rings with stuck contacts, or free ones where no contact is pressed; 0: none",
        200,
        ge=0,
        le=100000,
    )
    seed: Whole = key("seed of the first ring; each following ring has the next whole number", 0, ge=0, le=2**53 - 1)
    harmonics: Whole = key("number of harmonics of the ring and of the tuned curve beside it", 1, ge=1, le=31)
    frequency_range: Annotated[tuple[Positive, Positive] | None, Meaning("Hz")] = key(
        "lowest and highest frequency, Hz; none: response.frequency",
        None,
        allowed="a list of two numbers, 1e-12 to 1e15, the second above the first",
    )
