"""A traced piece of a curve: its points, its peaks and how it ended."""

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

from nonlinear.branches.bifurcations import BifurcationKind, locate_bifurcations
from nonlinear.branches.peaks import locate_peak
from nonlinear.branches.termination import TerminationReason
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.solution_point import SolutionPoint


class Branch(NamedTuple):
    """Points of growing arc, indices of peaks and of bifurcations among them, and how the tracing ended."""

    points: list[SolutionPoint]
    peak_indices: list[int]
    bifurcations: list[tuple[BifurcationKind, int]]
    termination: TerminationReason

    def reversed(self) -> "Branch":
        """The same trace the other way round."""
        last = len(self.points) - 1
        peaks = [last - index for index in reversed(self.peak_indices)]
        bifurcations = [(kind, last - index) for kind, index in reversed(self.bifurcations)]
        return Branch(reverse(self.points), peaks, bifurcations, self.termination)


def with_special_points(
    continuation: Continuation, points: list[SolutionPoint], termination: TerminationReason
) -> Branch:
    """The trace with the located maxima and bifurcations among its points."""
    trace = Branch(points[:1], [], [], termination)
    for before, after in pairwise(points):
        peak = locate_peak(continuation, before, after)
        found: list[tuple[BifurcationKind | None, SolutionPoint]] = [] if peak is None else [(None, peak)]
        found += locate_bifurcations(continuation, before, after)
        for kind, point in sorted(found, key=lambda event: event[1].arc):
            index = _insert(trace.points, point, before, after)
            if kind is None:
                trace.peak_indices.append(index)
            else:
                trace.bifurcations.append((kind, index))
        trace.points.append(after)
    return trace


def with_stability(continuation: Continuation, trace: Branch) -> Branch:
    """A trace that was made without exponents, with those of its points, and with the bifurcations that they tell of.

    Folds, which are known without, are located again: so that they lie in their place among the others.
    """
    folds, peaks = {index for _, index in trace.bifurcations}, set(trace.peak_indices)
    found = Branch([], [], [], trace.termination)
    for index, point in enumerate(trace.points):
        if index in folds and index not in peaks and 0 < index < len(trace.points) - 1:
            continue
        after = continuation.of(point.balance).with_exponents(point)
        if found.points:
            before = found.points[-1]
            for kind, event in sorted(locate_bifurcations(continuation, before, after), key=lambda item: item[1].arc):
                found.bifurcations.append((kind, _insert(found.points, event, before, after)))
        if index in peaks:
            found.peak_indices.append(len(found.points))
        found.points.append(after)
    return found


def _insert(points: list[SolutionPoint], point: SolutionPoint, before: SolutionPoint, after: SolutionPoint) -> int:
    """Append a point unless it is one of its neighbours; its index, or theirs."""
    if point is after:
        return len(points)
    if point is not before and point is not points[-1]:
        points.append(point)
    return len(points) - 1


def reverse(points: list[SolutionPoint]) -> list[SolutionPoint]:
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


def joined(backward: list[SolutionPoint], forward: list[SolutionPoint]) -> list[SolutionPoint]:
    """One curve of two that leave the same point in opposite directions."""
    first = reverse(backward)
    return [*first, *(replace(point, arc=first[-1].arc + point.arc) for point in forward[1:])]
