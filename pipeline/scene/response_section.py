"""[rom] and [response] of a scene: the reduction, and which curve is solved for and how."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from pipeline.scene.fields import POSITIVE, NotNegative, Number, Positive, Ratio, Section, Truth, Whole, key

DEFAULT_MODES = 30


class Rom(Section):
    """[rom]: Craig-Bampton reduction."""

    modes: Literal["auto"] | Annotated[Whole, Field(ge=1, le=1000)] | None = key(
        'fixed-interface modes kept, or "auto": as many as the tolerance asks for',
        'a whole number, {bounds}, or "auto"',
        None,
    )
    frequency_limit: Positive | None = key("keep every fixed-interface mode up to this, Hz", POSITIVE, None)
    contact_dofs: Literal["mortar", "patch", "nodal"] = key(
        "displacements of the contact nodes: of the face projected on polynomials, averages over parts of the face, "
        "or displacements of mesh nodes",
        "{words}",
        "mortar",
    )
    tolerance: Number = key(
        "largest relative error of frequencies and receptances in the frequency range",
        "a number from {bounds}",
        1e-3,
        ge=1e-6,
        le=0.5,
    )
    nodal_diameters: Annotated[tuple[Annotated[Whole, Field(ge=0, le=5000)], ...], Field(min_length=1)] | None = key(
        "nodal diameters of the waves whose motions of a disk's cut faces are kept; by default 0, 2, a quarter and "
        "half of the number of blades",
        "a list of whole numbers, {bounds}",
        None,
    )

    @property
    def fixed_interface_modes(self) -> int | Literal["auto"] | None:
        """Number of fixed-interface modes, the default where the scene says nothing; None with `frequency_limit`."""
        if self.modes is None and self.frequency_limit is None:
            return DEFAULT_MODES
        return self.modes


class Response(Section):
    """[response]: which curve, how many harmonics, how much damping."""

    frequency: tuple[Positive, Positive] = key(
        "range, Hz", "two numbers above 0, {bounds}, the second above the first"
    )
    harmonics: Annotated[Whole, Field(ge=1, le=99)] | Literal["auto"] = key(
        "harmonics of the balance; auto: as many as the tolerance asks for", 'a whole number, {bounds}, or "auto"', 1
    )
    tolerance: Number = key(
        "largest truncation error (neglected harmonics) that auto accepts, relative to the peak",
        "a number from {bounds}",
        1e-3,
        ge=1e-6,
        le=0.5,
    )
    damping_ratio: Ratio | Annotated[tuple[Ratio, ...], Field(min_length=1)] | None = key(
        "fraction of critical damping of each mode",
        "a number from {low}, below {high}, or a list of such numbers mode by mode (give this or rayleigh)",
        None,
    )
    rayleigh: tuple[NotNegative, NotNegative] | None = key(
        "[a, b] of C = a M + b K, 1/s and s", "two numbers, {bounds}, not both 0 (give this or damping_ratio)", None
    )
    method: Literal["coupled", "static-first"] = key(
        "statics and dynamics together, or a static contact analysis first", "{words}", "coupled"
    )
    stability: Literal["ring", "wave", "folds"] = key(
        "Floquet exponents of every nodal diameter, of the wave only, or only the unstable part between folds",
        "{words}",
        "ring",
    )
    residual_tractions: Literal["projected", "bounds"] = key(
        "traction of nodes that stick all the time: the paper's, or also the lowest and the highest peak it allows",
        "{words}",
        "projected",
    )
    detached: Truth = key("whether detached branches (isolas) are looked for", "true or false", True)
    truncation: Truth = key("whether the truncation error (neglected harmonics) is estimated", "true or false", True)
    search: Literal["off", "quick", "standard", "thorough"] = key(
        "how far the worst motion is sought in time: 0, 0.25, 1 or 10 times the curve's cost", "{words}", "standard"
    )
    seed: Whole = key("seed of the random states of that search", "a whole number, {bounds}", 0, ge=0, le=2**53 - 1)
    effort: Positive = key("factor on the work that a curve may take before it is ended", POSITIVE, 1.0)
