"""[rom] and [response] of a scene: the reduction, and which curve is solved for and how."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from pipeline.scene.fields import (
    HERTZ,
    Meaning,
    NotNegative,
    Number,
    Positive,
    Ratio,
    Section,
    Truth,
    Usual,
    Whole,
    key,
)

DEFAULT_MODES = 30


class Rom(Section):
    """[rom]: Craig-Bampton reduction."""

    modes: Annotated[
        Literal["auto"] | Annotated[Whole, Field(ge=1, le=1000)] | None, Meaning(symbol="modes kept", words="nmodes")
    ] = key(
        f'fixed-interface modes kept, {DEFAULT_MODES} by default, or "auto": as many as the tolerance asks for', None
    )
    frequency_limit: Annotated[Positive | None, Meaning("Hz", usual=Usual(1.0, 1e7, HERTZ))] = key(
        "instead of modes: keep every fixed-interface mode up to this, Hz", None
    )
    contact_dofs: Annotated[Literal["mortar", "patch", "nodal"], Meaning(symbol="contact dofs")] = key(
        "displacements at the Gauss points of the face projected on polynomials, averages over equal parts of the "
        "face, or of mesh nodes",
        "mortar",
    )
    tolerance: Number = key(
        'largest relative error of frequencies and receptances, with modes = "auto" and of shroud verify',
        1e-3,
        ge=1e-6,
        le=0.5,
    )
    nodal_diameters: Annotated[tuple[Annotated[Whole, Field(ge=0, le=5000)], ...], Field(min_length=1)] | None = key(
        "waves whose motions of a disk's cut faces are kept; by default 0, 2, a quarter and half of the number of "
        "blades",
        None,
        allowed="a list of whole numbers, {bounds}",
    )

    @property
    def fixed_interface_modes(self) -> int | Literal["auto"] | None:
        """Number of fixed-interface modes, the default where the scene says nothing; None with `frequency_limit`."""
        if self.modes is None and self.frequency_limit is None:
            return DEFAULT_MODES
        return self.modes


class Response(Section):
    """[response]: which curve, how many harmonics, how much damping."""

    frequency: Annotated[
        tuple[Positive, Positive],
        Meaning("Hz", usual=Usual(0.1, 1e6, HERTZ, most=1e9), words="freq frequencies range frequencyrange"),
    ] = key("range, Hz", allowed="two numbers above 0, {bounds}, the second above the first")
    harmonics: Annotated[
        Annotated[Whole, Field(ge=1, le=99)] | Literal["auto"], Meaning(symbol="harmonics", words="nh nharmonics")
    ] = key("harmonics of the balance, beside the mean; auto: as many as the tolerance asks for", 1)
    tolerance: Number = key(
        "largest truncation error (neglected harmonics) that auto accepts, relative to the peak",
        1e-3,
        ge=1e-6,
        le=0.5,
    )
    damping_ratio: Annotated[
        Ratio | Annotated[tuple[Ratio, ...], Field(min_length=1)] | None,
        Meaning(
            symbol="damping ratio",
            usual=Usual(0.0, 0.1, "the key is a fraction: 0.003 is 0.3 %", any_units=True),
            words="zeta xi damping dampingfactor",
            solver="damping",
            at_once=True,
            role="condition",
            searched="decade",
            decades=1.0,
        ),
    ] = key(
        "fraction of critical damping; of a list the last holds for the rest",
        None,
        allowed="a number from {low}, below {high}, or a list of such numbers mode by mode (give this or rayleigh)",
    )
    rayleigh: Annotated[tuple[NotNegative, NotNegative] | None, Meaning(role="condition")] = key(
        "[a, b] of C = a M + b K, 1/s and s",
        None,
        allowed="two numbers, {bounds}, not both 0 (give this or damping_ratio)",
    )
    method: Literal["coupled", "static-first"] = key(
        "statics and dynamics together, or a static contact analysis first", "coupled"
    )
    stability: Annotated[Literal["ring", "wave", "folds"], Meaning(formerly={"floquet": "ring"})] = key(
        "Floquet exponents of every nodal diameter, of the wave only, or only the unstable part between folds", "ring"
    )
    residual_tractions: Literal["projected", "bounds"] = key(
        "traction of nodes that stick all the time: the paper's, or also the lowest and the highest peak it allows",
        "projected",
    )
    detached: Truth = key(
        "whether detached branches (isolas) are looked for, in a sweep also those of neighbouring curves", True
    )
    truncation: Truth = key(
        "whether the truncation error (neglected harmonics) of the highest peak of every branch is estimated", True
    )
    search: Annotated[
        Literal["off", "quick", "standard", "thorough"], Meaning(words="timeintegration bladeperiods")
    ] = key("how far the worst motion is sought in time: 0, 0.25, 1 or 10 times the curve's cost", "standard")
    seed: Whole = key(
        "seed of the random states of that search: another worst motion with another seed is a lower bound",
        0,
        ge=0,
        le=2**53 - 1,
    )
    effort: Positive = key("factor on the work that a curve may take before it is ended", 1.0)
