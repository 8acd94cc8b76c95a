"""A traced piece of a curve: its points, its peaks and how it ended."""

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

from nonlinear.continuation import Continuation
from nonlinear.curve_point import CurvePoint
from nonlinear.outcome import Outcome
from nonlinear.peaks import locate_peak


class Trace(NamedTuple):
    """Points of growing arc, the indices of the located peaks among them, and how the tracing ended."""

    points: list[CurvePoint]
    peak_indices: list[int]
    outcome: Outcome


def with_peaks(continuation: Continuation, points: list[CurvePoint], outcome: Outcome) -> Trace:
    """The trace with the located maxima among its points."""
    result, indices = points[:1], []
    for before, after in pairwise(points):
        peak = locate_peak(continuation, before, after)
        if peak is not None:
            if peak is not before and peak is not after:
                result.append(peak)
            indices.append(len(result) - 1 if peak is not after else len(result))
        result.append(after)
    return Trace(result, indices, outcome)


def reverse(points: list[CurvePoint]) -> list[CurvePoint]:
    """The same points the other way round."""
    whole = points[-1].arc
    return [
        replace(
            point,
            arc=whole - point.arc,
            tangent=(-point.tangent[0], -point.tangent[1]),
            orientation=-point.orientation,
            amplitude_slope=-point.amplitude_slope,
        )
        for point in reversed(points)
    ]


def joined(backward: list[CurvePoint], forward: list[CurvePoint]) -> list[CurvePoint]:
    """One curve of two that leave the same point in opposite directions."""
    first = reverse(backward)
    return [*first, *(replace(point, arc=first[-1].arc + point.arc) for point in forward[1:])]
