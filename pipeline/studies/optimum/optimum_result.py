"""What the study `optimum` found."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from nonlinear import JointOptimum, Optimum


@dataclass(frozen=True)
class Trial:
    """The worst motion with some values of the keys.

    Attributes
    ----------
    values : mapping of str to float
        The keys with their values, in the units of the scene.
    amplitude_m, frequency_hz : float
        The worst motion, m and Hz; NaN where there is none.
    motion : str
        "periodic" or "quasi-periodic"; "peak" where no motion is known to persist and the highest peak is meant.
    at_end : bool
        Whether its frequency is an end of the frequency range: no peak, and no candidate.
    truncation_error : float
        Estimated relative error of the amplitude by neglected harmonics; NaN without an estimate.
    unresolved : str
        What the search for the worst motion left open; "" where nothing.
    reason : str
        Why there is no motion; "" where there is one.
    """

    values: Mapping[str, float]
    amplitude_m: float = math.nan
    frequency_hz: float = math.nan
    motion: str = ""
    at_end: bool = False
    unresolved: str = ""
    reason: str = ""
    truncation_error: float = math.nan

    @property
    def height(self) -> float:
        """The amplitude, m; infinite where there is none, and at an end of the frequency range."""
        return self.amplitude_m if math.isfinite(self.amplitude_m) and not self.at_end else math.inf


@dataclass(frozen=True)
class OptimumResult:
    """Values of keys of a scene at which its worst motion is lowest.

    Attributes
    ----------
    ranges : mapping of str to (float, float)
        The keys with their ranges, in the units of the scene.
    values : mapping of str to float
        Their values at the optimum.
    amplitude_m, frequency_hz : float
        The worst motion there, m and Hz.
    motion : str
        What it is, as of `Trial`.
    kind : str
        "smooth", "kink", "jump", "sampled", "edge" or "flat", as of `nonlinear.Optimum`.
    curvature : float
        Second derivative of the amplitude by the key at a smooth minimum, m per unit squared; NaN else.
    within : mapping of str to (float, float)
        Range of each key around the optimum in which the worst motion is at most 10 % higher, the others at their
        optimum; of keys for which it is not known there is none.
    derivatives : mapping of str to float
        Derivatives of the amplitude with respect to keys of contact, load and damping, m per unit of the key.
    base : Trial
        The worst motion with the scene's own values.
    search : Optimum or None
        What `nonlinear.find_optimum` found, where peaks were followed over one key, the other keys at the optimum:
        envelope, followed peaks, responses. In the units of the solver.
    joint : JointOptimum or None
        What `nonlinear.find_joint_optimum` found, where peaks were followed over two or three keys.
    per_unit : float
        Value of that key for each unit of the solver's parameter: stiffnesses of the whole face and the mean of the
        nodes differ, the damping of the solver is a factor.
    method : str
        "peaks": peaks followed over keys of the solver; "curves": curves at single values; "both".
    trials : tuple of Trial
        The values tried, where curves were solved at single values.
    responses : int
        Number of responses that were solved or found in the store.
    seconds : float
        Time of the search, s.
    message : str
        One line that says what was found.
    remarks : tuple of str
        What was left open, a sentence each.
    objective : str
        What is made low: "displacement", the largest displacement over a period; "harmonic_1", its first harmonic.
    harmonics : int
        Number of harmonics at the optimum; 0: not known.
    truncation_error : float
        Estimated relative error of the amplitude at the optimum by neglected harmonics; NaN without an estimate.
    """

    ranges: Mapping[str, tuple[float, float]]
    values: Mapping[str, float]
    amplitude_m: float
    frequency_hz: float
    motion: str
    kind: str
    curvature: float
    within: Mapping[str, tuple[float, float]]
    derivatives: Mapping[str, float]
    base: Trial
    search: Optimum | None
    joint: JointOptimum | None
    per_unit: float
    method: str
    trials: tuple[Trial, ...]
    responses: int
    seconds: float
    message: str
    remarks: tuple[str, ...] = field(default=())
    objective: str = "displacement"
    harmonics: int = 0
    truncation_error: float = math.nan

    @property
    def gain(self) -> float:
        """Worst motion with the scene's own values over that at the optimum; NaN where one is not known."""
        if self.base.at_end:
            return math.nan
        return self.base.amplitude_m / self.amplitude_m if self.amplitude_m else math.nan
