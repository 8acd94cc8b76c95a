"""Which neighbouring points of a map continue each other: where the worst motion jumps, nothing is interpolated."""

from __future__ import annotations

import math

import numpy as np

from pipeline.studies.worst_motion_map.lattice import Indices
from pipeline.studies.worst_motion_map.map_point import MapPoint

LARGEST_STEP = 0.10  # relative change of the frequency between neighbours that is still interpolated
LARGEST_RATIO = 4.0  # the same of the amplitude, as a ratio
FREQUENCY_WEIGHT = 10.0  # from one value to the next a resonance changes much less in frequency than in height
SAME_PEAK = 0.1  # distance below which two peaks of a curve are not told apart


def continuing(points: list[MapPoint] | tuple[MapPoint, ...], edges: Indices) -> np.ndarray:
    """Whether the two points of each edge continue each other, (e,) bool."""
    return np.array([continue_each_other(points[a], points[b]) for a, b in edges.tolist()], dtype=bool)


def continue_each_other(here: MapPoint, there: MapPoint) -> bool:
    """Whether the worst motion changes continuously from one point to its neighbour, as far as the two curves tell.

    It does not where one is not known or of another kind (quasi-periodic), where the peak of the neighbour that
    is nearest to the worst motion here is not the neighbour's worst motion (the highest of two peaks has changed,
    or a detached branch ends in between), or where frequency or amplitude change so much that the grid does not
    resolve the change. Distances are |ln a'/a| + 10 |ln f'/f|.
    """
    if not (here.is_known and there.is_known) or here.motion != there.motion:
        return False
    step, ratio = _logarithms(_worst(here), _worst(there))
    if step > math.log1p(LARGEST_STEP) or ratio > math.log(LARGEST_RATIO):
        return False
    return _leads_to_worst(here, there) and _leads_to_worst(there, here)


def _leads_to_worst(start: MapPoint, end: MapPoint) -> bool:
    """Whether of all motions of `end` its worst one is nearest to the worst one of `start`."""
    worst = _worst(start)
    own = _distance(worst, _worst(end))
    others = (peak for peak in end.peaks if _distance(peak, _worst(end)) > SAME_PEAK)
    return all(own <= _distance(worst, peak) for peak in others if peak[1] > 0.0)


def _worst(point: MapPoint) -> tuple[float, float]:
    assert point.frequency_hz is not None
    assert point.amplitude_m is not None
    return point.frequency_hz, point.amplitude_m


def _distance(one: tuple[float, float], other: tuple[float, float]) -> float:
    frequency, amplitude = _logarithms(one, other)
    return FREQUENCY_WEIGHT * frequency + amplitude


def _logarithms(one: tuple[float, float], other: tuple[float, float]) -> tuple[float, float]:
    """|ln| of the ratios of frequencies and of amplitudes."""
    return abs(math.log(other[0] / one[0])), abs(math.log(other[1] / one[1]))
