"""A branch of a response curve: its points, peaks and bifurcations, and why it ended."""

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

from nonlinear.branches.bifurcations import BifurcationKind, locate_bifurcations
from nonlinear.branches.peaks import locate_peak
from nonlinear.branches.termination import TerminationReason
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.solution_point import SolutionPoint


class Branch(NamedTuple):
    """Points of a branch.

    Attributes
    ----------
    points : list of SolutionPoint
        In the order of growing arc length.
    peak_indices : list of int
        Indices of the peaks among the points.
    bifurcations : list of (BifurcationKind, int)
        Kinds of the bifurcations and their indices among the points.
    termination : TerminationReason
        Why the continuation ended.
    """

    points: list[SolutionPoint]
    peak_indices: list[int]
    bifurcations: list[tuple[BifurcationKind, int]]
    termination: TerminationReason

    def reversed(self) -> "Branch":
        """The same branch in the opposite direction."""
        last = len(self.points) - 1
        peaks = [last - index for index in reversed(self.peak_indices)]
        bifurcations = [(kind, last - index) for kind, index in reversed(self.bifurcations)]
        return Branch(reverse(self.points), peaks, bifurcations, self.termination)


def with_special_points(
    continuation: Continuation, points: list[SolutionPoint], termination: TerminationReason
) -> Branch:
    """The branch of these points, with its peaks and bifurcations located and inserted."""
    branch = Branch(points[:1], [], [], termination)
    for before, after in pairwise(points):
        peak = locate_peak(continuation, before, after)
        found: list[tuple[BifurcationKind | None, SolutionPoint]] = [] if peak is None else [(None, peak)]
        found += locate_bifurcations(continuation, before, after)
        for kind, point in sorted(found, key=lambda special: special[1].arc):
            index = _insert(branch.points, point, before, after)
            if kind is None:
                branch.peak_indices.append(index)
            else:
                branch.bifurcations.append((kind, index))
        branch.points.append(after)
    return branch


def with_stability(continuation: Continuation, branch: Branch) -> Branch:
    """A branch solved without exponents, with the exponents of its points and the bifurcations that follow from them.

    Folds, known without exponents, are located again, so that all bifurcations are in order.
    """
    folds, peaks = {index for _, index in branch.bifurcations}, set(branch.peak_indices)
    result = Branch([], [], [], branch.termination)
    for index, point in enumerate(branch.points):
        if index in folds and index not in peaks and 0 < index < len(branch.points) - 1:
            continue
        current = continuation.with_balance(point.balance)
        after = current.recorder.with_exponents(point)
        if result.points:
            before = result.points[-1]
            for kind, special in sorted(locate_bifurcations(current, before, after), key=lambda item: item[1].arc):
                result.bifurcations.append((kind, _insert(result.points, special, before, after)))
        if index in peaks:
            result.peak_indices.append(len(result.points))
        result.points.append(after)
    return result


def _insert(points: list[SolutionPoint], point: SolutionPoint, before: SolutionPoint, after: SolutionPoint) -> int:
    """Append a special point unless it is one of its neighbours; its index, or theirs."""
    if point is after:
        return len(points)
    if point is not before and point is not points[-1]:
        points.append(point)
    return len(points) - 1


def reverse(points: list[SolutionPoint]) -> list[SolutionPoint]:
    """The same points in the opposite direction."""
    length = points[-1].arc
    return [replace(point.reversed(), arc=length - point.arc) for point in reversed(points)]


def join(backward: list[SolutionPoint], forward: list[SolutionPoint]) -> list[SolutionPoint]:
    """One curve from two that leave the same point in opposite directions."""
    first = reverse(backward)
    return [*first, *(replace(point, arc=first[-1].arc + point.arc) for point in forward[1:])]
