"""The grid of a map: values of its two keys, values at places between them, and its points.

A point is the worst motion of one curve with its contact state, and all peaks of the curve.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pipeline.results.worst import FREE, SEPARATING, SLIPPING, STUCK, UNKNOWN, contact_state, number_error
from pipeline.stages.curve.curve_file import BRANCHES
from pipeline.stages.curve.curve_summary import CurveSummary

if TYPE_CHECKING:
    from pipeline.stages.curve.respond import CurveResult


STATES = (FREE, SEPARATING, SLIPPING, STUCK, UNKNOWN)


@dataclass(frozen=True)
class MapPoint:
    """One curve of a map."""

    # column and row in the grid, whole numbers at the values of the grid, fractions between them
    place: tuple[float, float]
    values: tuple[float, float]  # values of the two keys, in SI units
    # worst motion, or the peak of the main branch where that is not known; None without either
    amplitude_m: float | None
    # worst motion, or the peak of the main branch where that is not known; None without either
    frequency_hz: float | None
    # contact at the worst motion: "free" (no node ever in contact), "separating" (some node opens at some time),
    # "slipping" (some node slips, none opens), "stuck" (all nodes stick all the time) or "unknown". Where the worst
    # motion is quasi-periodic the state is that of the periodic solution that it departs from
    state: str = UNKNOWN
    branch: int = -1  # branch of the worst motion: 0 the main one, k detached branch k, -1 none of them
    motion: str = ""  # "periodic" or "quasi-periodic"; empty where the worst motion is not known
    # why the worst motion may be higher, or why the curve has not come to its end; empty where no reason is known
    may_be_higher: str = ""
    # frequency, Hz, and amplitude, m, of the local maxima of every branch
    peaks: tuple[tuple[float, float], ...] = ()
    # whether the worst motion lies at an end of the frequency range: no peak, and no candidate for the lowest
    at_end: bool = False
    # estimated relative error of the amplitude by neglected harmonics; NaN without an estimate
    truncation_error: float = math.nan

    @property
    def is_known(self) -> bool:
        """Whether there is an amplitude."""
        return self.amplitude_m is not None and self.amplitude_m > 0.0

    @property
    def height(self) -> float:
        """Amplitude, m; nan where it is not known."""
        return math.nan if self.amplitude_m is None else self.amplitude_m

    @property
    def is_detached(self) -> bool:
        """Whether the worst motion lies on a detached branch."""
        return self.branch > 0


def map_point(curve: CurveResult, place: tuple[float, float], values: tuple[float, float]) -> MapPoint:
    """The point of a solved curve; its file is read."""
    facts = curve.facts
    if curve.file is None or facts is None or not facts.points:
        return MapPoint(place, values, None, None, may_be_higher=curve.reason or "no point was solved")
    worst = math.isfinite(facts.worst_amplitude_m)
    return MapPoint(
        place,
        values,
        amplitude_m=_finite(facts.worst_amplitude_m if worst else facts.peak_amplitude_m),
        frequency_hz=_finite(facts.worst_frequency_hz if worst else facts.peak_frequency_hz),
        state=contact_state(curve.file, facts),
        branch=facts.worst_branch if worst else 0,
        motion=facts.worst_motion if worst else "",
        may_be_higher=_left_open(facts, worst),
        peaks=_peaks(curve.file, facts),
        at_end=facts.at_end,
        truncation_error=number_error(facts),
    )


def _left_open(facts: CurveSummary, worst: bool) -> str:
    if not facts.complete:
        return facts.reason
    return facts.worst_unresolved if worst else "the worst motion is not known"


def _peaks(file: Path, facts: CurveSummary) -> tuple[tuple[float, float], ...]:
    """The peaks of all branches of a curve, Hz and m; only those of detached branches are in the file alone."""
    import h5py

    listed = [facts.peaks]
    if facts.detached:
        with h5py.File(file, "r") as source:
            groups = [source[BRANCHES][name] for name in sorted(source.get(BRANCHES, ()), key=int)]
            listed += [json.loads(group.attrs.get("peaks", "[]")) for group in groups]
    return tuple((float(peak["frequency_hz"]), float(peak["amplitude_m"])) for found in listed for peak in found)


def known_heights(points: Sequence[MapPoint]) -> np.ndarray:
    """Amplitudes, m, (n,); nan where not known."""
    return np.array([point.height for point in points], dtype=float)


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


Place = tuple[float, float]


@dataclass(frozen=True)
class MapAxis:
    """One key of a map."""

    key: str  # its dotted key
    values: tuple[float, ...]  # ascending values of the grid, in SI units
    logarithmic: bool = False  # whether values between them lie in the middle of the logarithm

    def value_at(self, place: float) -> float:
        """Value at a column or row, which may be a fraction."""
        below = min(int(place), len(self.values) - 2)
        low, high, part = self.values[below], self.values[below + 1], place - below
        if part in (0.0, 1.0):
            return high if part else low
        if self.logarithmic:
            return rounded(low * (high / low) ** part)
        return rounded(low + part * (high - low))


@dataclass(frozen=True)
class MapGrid:
    """The grid of a map: its two keys, columns first."""

    axes: tuple[MapAxis, MapAxis]

    def values_at(self, place: Place) -> tuple[float, float]:
        """Values of both keys at a column and row."""
        return self.axes[0].value_at(place[0]), self.axes[1].value_at(place[1])

    def places(self) -> list[Place]:
        """Column and row of all points of the grid, the row changing fastest."""
        columns, rows = (range(len(axis.values)) for axis in self.axes)
        return [(float(column), float(row)) for column in columns for row in rows]


def rounded(value: float) -> float:
    """A value to 12 digits: the same number, whatever way it was computed."""
    return float(f"{value:.12g}")


def spaced(low: float, high: float, count: int, logarithmic: bool) -> tuple[float, ...]:
    """`count` values from `low` to `high`, evenly spaced, or evenly in their logarithm and rounded to four digits."""
    if logarithmic:
        ratio = math.log(high / low) / (count - 1)
        inner = tuple(float(f"{low * math.exp(k * ratio):.4g}") for k in range(1, count - 1))
        return (low, *inner, high)
    step = (high - low) / (count - 1)
    inner = tuple(rounded(low + k * step) for k in range(1, count - 1))
    return (low, *(0.0 if abs(value) < 1e-9 * step else value for value in inner), high)


def even_in_logarithm(values: Sequence[float]) -> bool:
    """Whether positive values are spaced more evenly in their logarithm than as they stand."""
    if len(values) < 3 or values[0] <= 0.0:
        return False
    steps = [high - low for low, high in pairwise(values)]
    ratios = [math.log(high / low) for low, high in pairwise(values)]
    return max(ratios) / min(ratios) < max(steps) / min(steps)
