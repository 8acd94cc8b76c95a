"""Sections [render] and [figures] of a scene: pictures of mode shapes, files of the figures."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from pipeline.scene.fields import Number, Section, Truth, Whole
from pipeline.scene.fields import key as _key


class Render(Section):
    """[render]: pictures of mode shapes. Without this section they are drawn where asked for by name."""

    modes: Annotated[tuple[Annotated[Whole, Field(ge=1, le=100)], ...], Field(min_length=1, max_length=20)] = _key(
        "mode shapes to draw, 1 is the lowest", "a list of 1 to 20 whole numbers, 1 to 100", (1, 2, 3)
    )
    deformation: Number = _key(
        "largest drawn displacement as a fraction of the blade's length",
        "a number above 0, 1e-12 to 1",
        0.08,
        ge=1e-12,
        le=1.0,
    )
    contact: Literal["free", "sliding", "stuck"] = _key(
        "how the shrouds are joined", '"free", "sliding" or "stuck"', "free"
    )
    operating: Truth | Annotated[tuple[Annotated[Whole, Field(ge=0)], ...], Field(min_length=1, max_length=20)] = (
        _key(
            "motion at the peak: true for the curves with the highest and the lowest peak, or their numbers from 0",
            "true, false or a list of 1 to 20 numbers of curves, the first is 0",
            False,
        )
    )
    blades: Whole = _key("neighbours drawn side by side", "a whole number, 1 to 9", 3, ge=1, le=9)


class Figures(Section):
    """[figures]: files that the figures are written to."""

    formats: Annotated[tuple[Literal["png", "svg"], ...], Field(min_length=1)] = _key(
        "formats of every figure", 'a list of "png", "svg" or both', ("png",)
    )
