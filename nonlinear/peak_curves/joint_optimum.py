"""The values of two or three parameters at which the worst motion is lowest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from nonlinear.branches.worst_motion import Motion, WorstMotion
from nonlinear.peak_curves.optimum_result import SolvedResponse


@dataclass(frozen=True)
class ActivePeak:
    """A peak that is as high as any at a joint optimum.

    Attributes
    ----------
    amplitude_m, frequency_hz : float
        The peak, m and Hz.
    multiplier : float
        Its share in the condition of the optimum, 0 to 1: the sum over the active peaks of multiplier times
        gradient vanishes, but for parameters at an end of their range.
    gradient : mapping of str to float
        Derivatives of the amplitude with respect to the parameters, m per unit.
    """

    amplitude_m: float
    frequency_hz: float
    multiplier: float
    gradient: Mapping[str, float]


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
    motion : {"periodic", "quasi-periodic"}
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
    """

    values: Mapping[str, float]
    ranges: Mapping[str, tuple[float, float]]
    at_end: Mapping[str, str]
    amplitude_m: float
    frequency_hz: float
    motion: Motion
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
