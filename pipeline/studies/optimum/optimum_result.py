"""What the study `optimum` found."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from nonlinear import JointOptimum, Optimum


@dataclass(frozen=True)
class Trial:
    """The worst motion with some values of the keys."""

    values: Mapping[str, float]  # the keys with their values, in the units of the scene
    amplitude_m: float = math.nan  # the worst motion, m and Hz; NaN where there is none
    frequency_hz: float = math.nan  # the worst motion, m and Hz; NaN where there is none
    # "periodic" or "quasi-periodic"; "peak" where no motion is known to persist and the highest peak is meant
    motion: str = ""
    at_end: bool = False  # whether its frequency is an end of the frequency range: no peak, and no candidate
    unresolved: str = ""  # what the search for the worst motion left open; "" where nothing
    reason: str = ""  # why there is no motion; "" where there is one
    # estimated relative error of the amplitude by neglected harmonics; NaN without an estimate
    truncation_error: float = math.nan

    @property
    def height(self) -> float:
        """The amplitude, m; infinite where there is none, and at an end of the frequency range."""
        return self.amplitude_m if math.isfinite(self.amplitude_m) and not self.at_end else math.inf


@dataclass(frozen=True)
class OptimumResult:
    """Values of keys of a scene at which its worst motion is lowest."""

    ranges: Mapping[str, tuple[float, float]]  # the keys with their ranges, in the units of the scene
    values: Mapping[str, float]  # their values at the optimum
    amplitude_m: float  # the worst motion there, m and Hz
    frequency_hz: float  # the worst motion there, m and Hz
    motion: str  # what it is, as of `Trial`
    kind: str  # "smooth", "kink", "jump", "sampled", "edge" or "flat", as of `nonlinear.Optimum`
    # second derivative of the amplitude by the key at a smooth minimum, m per unit squared; NaN else
    curvature: float
    # range of each key around the optimum in which the worst motion is at most 10 % higher, the others at their
    # optimum; of keys for which it is not known there is none
    within: Mapping[str, tuple[float, float]]
    # derivatives of the amplitude with respect to keys of contact, load and damping, m per unit of the key
    derivatives: Mapping[str, float]
    base: Trial  # the worst motion with the scene's own values
    # what `nonlinear.find_optimum` found, where peaks were followed over one key, the other keys at the optimum:
    # envelope, followed peaks, responses. In the units of the solver
    search: Optimum | None
    # what `nonlinear.find_joint_optimum` found, where peaks were followed over two or three keys
    joint: JointOptimum | None
    # value of that key for each unit of the solver's parameter: stiffnesses of the whole face and the mean of the
    # nodes differ, the damping of the solver is a factor
    per_unit: float
    method: str  # "peaks": peaks followed over keys of the solver; "curves": curves at single values; "both"
    trials: tuple[Trial, ...]  # the values tried, where curves were solved at single values
    responses: int  # number of responses that were solved or found in the store
    seconds: float  # time of the search, s
    message: str  # one line that says what was found
    remarks: tuple[str, ...] = field(default=())  # what was left open, a sentence each
    # what is made low: "displacement", the largest displacement over a period; "harmonic_1", its first harmonic
    objective: str = "displacement"
    harmonics: int = 0  # number of harmonics at the optimum; 0: not known
    # estimated relative error of the amplitude at the optimum by neglected harmonics; NaN without an estimate
    truncation_error: float = math.nan

    @property
    def gain(self) -> float:
        """Worst motion with the scene's own values over that at the optimum; NaN where one is not known."""
        if self.base.at_end:
            return math.nan
        return self.base.amplitude_m / self.amplitude_m if self.amplitude_m else math.nan
