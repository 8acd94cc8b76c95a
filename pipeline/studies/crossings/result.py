"""What the study `crossings` gives: plain frozen data, as in crossings.json."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.stages.curve.curve_summary import CurveSummary

Numbers = NDArray[np.float64]


@dataclass(frozen=True)
class ModeLine:
    """Natural frequencies of one mode in the wave of an engine order, over the speeds of the result."""

    engine_order: int
    mode: int  # its number in the wave, from 1
    name: str  # by its shape with free contacts; "mode 1" where shapes are not known
    free_hz: Numbers  # (K,), with free contacts
    stuck_hz: Numbers  # (K,), with stuck ones


@dataclass(frozen=True)
class Exceedance:
    """The probability that the worst motion of a crossing exceeds a limit, by followed peaks."""

    limit_m: float  # the amplitude; that at which the margin is no longer kept, where this is lower
    probability: float
    low: float  # ends of its interval, 95 %, widened by what whole curves differ
    high: float
    samples: int  # at which the worst motion was solved for
    error: float  # relative, of the polynomial that tells which samples are near the limit
    replaced: int = 0  # of them by whole curves, where the followed peak was lost
    curves: int = 0  # whole curves near the limit beside followed peaks
    curve_error: float = 0.0  # largest relative difference of their worst motion


@dataclass(frozen=True)
class Scatter:
    """How the worst motion of a crossing varies."""

    tolerance: tuple[float, float] | None  # lowest and highest relative change within the tolerances
    exceedance: Exceedance | None
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class Crossing:
    """One crossing: the worst motion of a mode under an engine order, at the speed where the two meet."""

    engine_order: int
    modes: tuple[int, ...]  # numbers of the modes in the wave whose worst motion it is
    name: str  # of these modes
    nodal_diameter: int
    wave: str  # "backward", "forward" or "standing"
    speed_rpm: float  # of the run
    parameters: Mapping[
        str, Any
    ]  # keys of the scene with the values of this run: `shroud run` with them gives the row
    worst: CurveSummary  # the curve of the run in numbers
    distance: float  # speed over the nearest steady speed, less 1
    frequency_error: float  # excitation frequency of the worst motion over that of the speed, less 1
    temperature: tuple[float, float] | None = None  # lowest and highest of the body, in the unit of the scene
    stress_pa: float = math.nan  # largest stress amplitude at the worst motion
    margin: float = math.nan  # least fatigue margin there
    scatter: Scatter | None = None  # where tolerances or limits are given
    amplification: float = math.nan  # highest of any blade of the mistuned rings over the tuned peak
    remarks: tuple[str, ...] = ()  # what is missing, and why

    @property
    def overlap_m(self) -> tuple[float, float]:
        """Smallest and largest overlap of the contact faces under the static loads at speed, m; negative: a gap."""
        static = self.worst.static_contacts.values()
        low, high = [each.lowest_m for each in static], [each.highest_m for each in static]
        return (min(low), max(high)) if low else (math.nan, math.nan)

    @property
    def normal_force_n(self) -> float:
        """Static normal force of all contacts at speed, N."""
        static = [each.force_n for each in self.worst.static_contacts.values()]
        return sum(static) if static else math.nan


@dataclass(frozen=True)
class CrossingsResult:
    """All crossings of a scene."""

    speed_rpm: tuple[float, float]  # range of the machine
    steady_rpm: tuple[float, ...]  # speeds that distances are measured from
    rows: tuple[Crossing, ...]  # by engine order and frequency
    speeds: Numbers  # (K,), of the natural frequencies, rev/min
    lines: tuple[ModeLine, ...]
    asked: tuple[str, ...] = ()  # tolerances, limits and laws that the rows are judged by, a line each
    left_out: tuple[str, ...] = ()  # what has no row, and why
    complete: bool = True  # whether the study came to its end
