"""What a search for the optimum found, over one parameter or several: plain frozen data, no objects of the solver."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.parameters import Array
from nonlinear.options import Objective
from nonlinear.response_curve import WorstMotion

Kind = Literal["smooth", "kink", "jump", "plateau", "sampled", "edge", "flat"]
Source = Literal["followed", "responses", "open", "unknown"]


class KindWords(NamedTuple):
    """What is said of a kind of optimum; `balanced`, `steep` and `inside`: with tolerances."""

    said: str  # in a table, a legend and the message
    sentence: str  # in the report


KINDS: dict[str, KindWords] = {
    "smooth": KindWords("smooth minimum", "The minimum is smooth"),
    "kink": KindWords(
        "kink: two peaks exchange", "Two peaks exchange there: the worst motion rises on both sides at once"
    ),
    "jump": KindWords(
        "beside a jump of the worst motion: keep a distance",
        "It lies beside a jump: on one side of it a much higher motion persists",
    ),
    "plateau": KindWords("lowest and constant around it", "Around it the lowest worst motion is constant"),
    "sampled": KindWords(
        "lowest of single curves", "No stable peak could be followed there: it is the lowest of the responses solved"
    ),
    "edge": KindWords("lowest at an end of a range", "There is no minimum inside the range: it is lowest at an end"),
    "balanced": KindWords("equal at both ends of the tolerance", "It is equal at both ends of the tolerance"),
    "steep": KindWords("just outside the tolerance it is much worse", "Just outside the tolerance it is much worse"),
    "inside": KindWords("decided inside the tolerance", "A peak inside the tolerance decides"),
    "flat": KindWords(
        "the worst motion changes by less than 0.1 % over the range", "The parameter hardly changes the worst motion"
    ),
}


@dataclass(frozen=True)
class PeakCurve:
    """One followed peak over the parameter, between two folds of the curve of peaks; P points."""

    value: Array  # (P,) the parameter, SI units, ascending
    amplitude_m: Array  # (P,) amplitude of the peak, m
    frequency_hz: Array  # (P,) its frequency, Hz
    # (P,) whether the motion persists, against perturbations of every nodal diameter that the options look at
    stable: NDArray[np.bool_]
    growth_rate: Array  # (P,) largest real part of the Floquet exponents, 1/s; NaN without exponents
    slope: Array  # (P,) derivative of the amplitude with respect to the parameter, m per unit
    origin: str  # branch of the response that the peak was found on


@dataclass(frozen=True)
class SolvedResponse:
    """The worst motion of one response solved with all options."""

    value: float  # the parameter, SI units
    # amplitude_m, frequency_hz: the worst motion, m and Hz, or its first harmonic where that is the objective and the
    # motion is periodic; NaN where no motion is known to persist
    amplitude_m: float
    frequency_hz: float
    # the same; where the search for the worst motion left something open, the highest solution of any branch if that
    # is higher, stable or not: what the ring does instead of it is not known
    bound_m: float
    motion: str  # what it is
    origin: str  # branch of the motion: "main branch", or how the detached branch was found
    highest_peak_m: float  # the highest solution on any branch, stable or not, m
    branches: int  # number of branches, the main one included
    # estimated relative error of the highest amplitude of that branch by neglected harmonics; NaN: no estimate
    truncation_error: float
    harmonics: int  # number of harmonics
    reason: str  # why the response was solved at this value: "first", "between", "search", "refinement", "optimum"
    unresolved: str = ""  # what the search for the worst motion left open; "" where nothing
    # whether the worst motion lies at an end of the frequency range: no candidate for an optimum
    at_end: bool = False

    @property
    def height(self) -> float:
        """`bound_m`; infinite where no motion is known, and at an end of the frequency range, where no peak is."""
        return self.bound_m if np.isfinite(self.bound_m) and not self.at_end else float("inf")


@dataclass(frozen=True)
class WorstEnvelope:
    """The worst motion over the parameter at K values."""

    value: Array  # (K,) the parameter, SI units, ascending. Two equal values bound a jump
    # amplitude_m, frequency_hz (K,): the worst motion, m and Hz; NaN where none is known
    amplitude_m: Array
    frequency_hz: Array
    # (K,) "followed": a stable followed peak. "responses": interpolated between the worst motions of single
    # responses. "open": the same, where it was left open what the ring does instead of the highest solution; that
    # solution counts (`SolvedResponse.bound_m`). "unknown": no motion is known
    source: NDArray[np.str_]
    motion: NDArray[np.str_]  # (K,) "periodic", "quasi-periodic" or "irregular"
    origin: NDArray[np.str_]  # (K,) branch of the motion
    # largest relative interpolation error seen where the envelope rests on single responses; 0 where it does so
    # nowhere
    error: float

    def at(self, values: Array) -> Array:
        """Amplitude of the worst motion at some values, m: linear between the K values, NaN beyond them.

        `values` (k,): the parameter, SI units.
        """
        known = np.isfinite(self.amplitude_m)
        if not known.any():
            return np.full(np.shape(values), np.nan)
        found = np.interp(values, self.value[known], self.amplitude_m[known], left=np.nan, right=np.nan)
        return np.asarray(found, dtype=np.float64)


@dataclass(frozen=True)
class Optimum:
    """Where the worst motion over a parameter is lowest.

    Attributes
    ----------
    name : str
        The parameter, see `find_optimum`.
    low, high : float
        Range of the parameter, SI units.
    value : float
        The parameter at the optimum, SI units.
    frequency_hz, amplitude_m : float
        The worst motion there. Never below that of a response solved there, `SolvedResponse.bound_m`.
    motion : {"periodic", "quasi-periodic", "irregular"}
        What it is.
    kind : {"smooth", "kink", "jump", "plateau", "sampled", "edge", "flat"}
        A minimum of one peak; an exchange of two; beside a value where the worst motion jumps, as a branch is born
        or a motion loses its stability; a part of the range over which the lowest amplitude does not change (contacts
        that stick), with `value` in its middle; the lowest of single responses, where no stable peak can be followed;
        an end of the range; the parameter hardly does anything.
    curvature : float
        Second derivative of the amplitude by the parameter at a smooth minimum; NaN else.
    slopes : (float, float)
        Derivative of the worst amplitude just below and just above the optimum, m per unit; infinite on the side of a
        jump; NaN beyond the range and where single responses do not tell.
    within : (float, float)
        Range of the parameter around it in which the worst motion is at most 10 % higher.
    derivatives : mapping of str to float
        Derivatives of the amplitude with respect to the parameters of contact, load and damping, m per unit; of
        "damping" with respect to a factor on the damping at the optimum. Empty where the worst motion is no followed
        peak.
    elasticities : mapping of str to float
        The same, relative: p / A dA/dp, in % per %.
    worst : WorstMotion or None
        The worst motion at the optimum, from a response solved with all options.
    envelope : WorstEnvelope
        The worst motion over the parameter.
    curves : tuple of PeakCurve
        The peaks followed.
    responses : tuple of SolvedResponse
        The responses solved, by ascending value.
    objective : {"displacement", "harmonic_1"}
        What amplitudes are, see `SolverOptions.objective`.
    harmonics : int
        Number of harmonics; the one chosen, where it was "auto".
    truncation_error : float
        Estimated relative error of the amplitude at the optimum by neglected harmonics; NaN without an estimate.
    seconds : float
        Time of the search, s.
    message : str
        One line that says what was found.
    remarks : tuple of str
        What was searched and what was left open, a sentence each.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from nonlinear import find_optimum
    >>> optimum = find_optimum((modal, contact, excitation, options), "preload", 0.5, 4.0)
    >>> print(optimum.message)
    preload = 3.06004: smooth minimum, 1.014 m at 0.251939 Hz
    >>> bool(optimum.within[0] < optimum.value < optimum.within[1]), abs(optimum.elasticities["preload"]) < 1e-6
    (True, True)
    """

    name: str
    low: float
    high: float
    value: float
    frequency_hz: float
    amplitude_m: float
    motion: str
    kind: Kind
    curvature: float
    slopes: tuple[float, float]
    within: tuple[float, float]
    derivatives: Mapping[str, float]
    elasticities: Mapping[str, float]
    worst: WorstMotion | None
    envelope: WorstEnvelope
    curves: tuple[PeakCurve, ...]
    responses: tuple[SolvedResponse, ...]
    harmonics: int
    truncation_error: float
    seconds: float
    message: str
    remarks: tuple[str, ...] = field(default=())
    objective: Objective = "displacement"

    @property
    def values(self) -> Mapping[str, float]:
        """The parameter by name, as of `JointOptimum`."""
        return {self.name: self.value}


@dataclass(frozen=True)
class ActivePeak:
    """A peak that is as high as any at a joint optimum."""

    # amplitude_m, frequency_hz: the peak, m and Hz
    amplitude_m: float
    frequency_hz: float
    # its share in the condition of the optimum, 0 to 1: the sum over the active peaks of multiplier times gradient
    # vanishes, but for parameters at an end of their range
    multiplier: float
    gradient: Mapping[str, float]  # derivatives of the amplitude with respect to the parameters, m per unit


@dataclass(frozen=True)
class JointOptimum:
    """Where the worst motion over several parameters is lowest.

    Attributes
    ----------
    values : mapping of str to float
        The parameters at the optimum, SI units.
    ranges : mapping of str to (float, float)
        Their ranges.
    at_end : mapping of str to {"", "low", "high"}
        Which parameters lie at an end of their range.
    amplitude_m, frequency_hz : float
        The worst motion there, m and Hz.
    motion : {"periodic", "quasi-periodic", "irregular"}
        What it is.
    peaks : tuple of ActivePeak
        The peaks as high as any there: more than one at a kink.
    derivatives, elasticities : mapping of str to float
        As of `Optimum`, of the highest peak.
    worst : WorstMotion or None
        The worst motion at the optimum, from a response solved with all options.
    path : tuple of (mapping of str to float, float)
        Values and worst amplitude, m, of the responses along the way to the optimum.
    responses : tuple of SolvedResponse
        These responses; `value` counts them.
    harmonics : int
        Number of harmonics.
    seconds : float
        Time of the search, s.
    message : str
        One line that says what was found.
    remarks : tuple of str
        What was searched and what was left open.
    objective : {"displacement", "harmonic_1"}
        What amplitudes are, see `SolverOptions.objective`.
    truncation_error : float
        As of `Optimum`.

    Examples
    --------
    With the names of the example of `find_joint_optimum`:

    >>> optimum.motion, round(optimum.values["tangential_stiffness"], 3), round(optimum.amplitude_m, 3)
    ('periodic', 3.0, 1.014)
    """

    values: Mapping[str, float]
    ranges: Mapping[str, tuple[float, float]]
    at_end: Mapping[str, str]
    amplitude_m: float
    frequency_hz: float
    motion: str
    peaks: tuple[ActivePeak, ...]
    derivatives: Mapping[str, float]
    elasticities: Mapping[str, float]
    worst: WorstMotion | None
    path: tuple[tuple[Mapping[str, float], float], ...]
    responses: tuple[SolvedResponse, ...]
    harmonics: int
    seconds: float
    message: str
    remarks: tuple[str, ...] = ()
    objective: Objective = "displacement"
    truncation_error: float = float("nan")

    @property
    def kind(self) -> Kind:
        """What it is, in the words of `Optimum`."""
        if any(self.at_end.values()):
            return "edge"
        if not self.peaks:
            return "sampled"
        return "kink" if len(self.peaks) > 1 else "smooth"
