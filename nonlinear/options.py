"""What the solver is asked to do and how precisely."""

from dataclasses import dataclass
from typing import Literal

Method = Literal["coupled", "static-first"]
Integration = Literal["exact", "sampled"]
Stability = Literal["floquet", "folds"]


MOST_UNKNOWNS = 10_000  # of a harmonic balance: its Jacobian is full, 0.8 GB, and is factorised at every step


def least_samples(n_harmonics: int) -> int:
    """Fewest instants a period, 4 H + 4, at which the contact force of H harmonics is sampled."""
    return 4 * n_harmonics + 4


class OptionsError(ValueError):
    """A solver option out of its range; the message names it, its value and what is allowed."""


@dataclass(frozen=True)
class Excitation:
    """Travelling-wave excitation of engine order `engine_order` and amplitude `force` (N on one blade)."""

    engine_order: int
    force: float


@dataclass(frozen=True)
class SolverOptions:
    """Frequency range, harmonics, contact integration, method and tolerances of a forced response.

    Attributes
    ----------
    frequency_hz : (low, high), Hz.
    harmonics : H, harmonics 0 .. H are balanced; "auto": as many as `harmonic_tolerance` asks for.
    harmonic_tolerance : largest estimated truncation error, relative to the peak amplitude, that "auto" accepts.
    integration : how the contact force is integrated over the cycle; "exact": from event to event (in closed form for
        the uncoupled law, with a controlled error for the coupled one), "sampled": at `samples` instants.
    samples : instants a period, at least 4 H + 4.
    method : "coupled" (static and dynamic balance together) or "static-first" (the classical two steps).
    detached : whether branches that hang on the curve nowhere are looked for.
    stability : "floquet": the Floquet exponents of every point; "folds": only the sign of a determinant, which sees
        the unstable part between two folds.
    truncation : whether the error of the harmonics left out is estimated, for half the cost of the curve or so.
    output : name of the output that peaks are sought for.
    tolerance : residual relative to the displacement at which Newton's method stops; where round-off stands in the
        way, it stops when nothing improves below `round_off`.
    step, max_step, min_step : first, largest and smallest arc length, relative to the local vibration amplitude.
    max_points : points after which a curve is given up.
    peak_tolerance : relative error of a peak's frequency.
    """

    frequency_hz: tuple[float, float]
    harmonics: int | Literal["auto"] = 1
    harmonic_tolerance: float = 1e-3
    integration: Integration = "exact"
    samples: int = 1024
    method: Method = "coupled"
    detached: bool = True
    stability: Stability = "floquet"
    truncation: bool = True
    output: str = "tip"
    tolerance: float = 1e-13
    round_off: float = 1e-12
    step: float = 0.05
    max_step: float = 0.25
    min_step: float = 1e-6
    max_points: int = 20000
    peak_tolerance: float = 1e-7

    def __post_init__(self) -> None:
        """Check ranges."""
        low, high = self.frequency_hz
        if not 0.0 < low < high < float("inf"):
            raise OptionsError(f"frequency: [{low}, {high}], allowed: 0 < low < high (Hz)")
        if self.harmonics != "auto" and (isinstance(self.harmonics, str) or self.harmonics < 1):
            raise OptionsError(f'harmonics: {self.harmonics!r}, allowed: 1 or more, or "auto"')
        if not 0.0 < self.harmonic_tolerance < 1.0:
            raise OptionsError(f"harmonic_tolerance: {self.harmonic_tolerance}, allowed: between 0 and 1")
        least = least_samples(1 if self.harmonics == "auto" else self.harmonics)
        if self.samples < least:
            raise OptionsError(f"samples: {self.samples}, allowed: {least} or more for so many harmonics")
        if self.integration not in ("exact", "sampled"):
            raise OptionsError(f'integration: {self.integration!r}, allowed: "exact" or "sampled"')
        if self.stability not in ("floquet", "folds"):
            raise OptionsError(f'stability: {self.stability!r}, allowed: "floquet" or "folds"')
        if self.method not in ("coupled", "static-first"):
            raise OptionsError(f'method: {self.method!r}, allowed: "coupled" or "static-first"')

    @property
    def fixed_harmonics(self) -> int:
        """H as a number.

        Raises
        ------
        OptionsError : it is "auto", which only `forced_response` resolves.
        """
        if isinstance(self.harmonics, str):
            raise OptionsError('harmonics: "auto", allowed here: a number')
        return self.harmonics
