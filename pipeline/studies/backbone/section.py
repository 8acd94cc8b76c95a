"""Section [backbone] of a scene: nonlinear modes, their resonances beside the peaks of the curves."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from pipeline.scene.fields import MOTION, Number, StudyKeys, Whole, key

MODES = "a list of 1 to 20 different whole numbers, 1 to 1000"
DIAMETERS = "a list of 1 to 20 different whole numbers, 0 to 100000"
AMPLITUDES = "a list of two numbers, 1e-12 to 1000, the second above the first"
Amplitude = Annotated[Number, Field(ge=1e-12, le=1e3)]
Curves = Annotated[tuple[Annotated[Whole, Field(ge=0)], ...], Field(min_length=1, max_length=100)]


class Backbone(StudyKeys):
    """[backbone]: frequency and damping of nonlinear modes over amplitude. Not computed without this section."""

    modes: Annotated[tuple[Annotated[Whole, Field(ge=1, le=1000)], ...], Field(min_length=1, max_length=20)] = key(
        "modes, 1 is the lowest at the smallest amplitude", (1,), allowed=MODES
    )
    nodal_diameters: (
        Annotated[tuple[Annotated[Whole, Field(ge=0, le=100000)], ...], Field(min_length=1, max_length=20)] | None
    ) = key(
        "none: the engine order of each curve, for which alone resonances and peaks are compared",
        None,
        allowed=DIAMETERS,
    )
    amplitudes: Annotated[tuple[Amplitude, Amplitude] | None, MOTION] = key(
        "smallest and largest amplitude of the default output, m; none: a tenth of the peak to 1.5 times the "
        "highest motion",
        None,
        allowed=AMPLITUDES,
    )
    curves: Literal["all"] | Curves = key(
        '"all": of more than 24 those with the highest and the lowest worst motion',
        "all",
        allowed='"all" or a list of 1 to 100 numbers of curves, the first is 0',
    )
    damping: Literal["first_harmonic", "all_harmonics"] = key(
        "harmonics of the damping that makes up for dissipation: resonances nearest to peaks, or the published "
        "definition (Krack 2015)",
        "first_harmonic",
    )
    tolerance: Number = key(
        "deviation from the peak above which reasons are given: of amplitude, or four times that of frequency",
        0.02,
        ge=1e-6,
        le=1.0,
    )
