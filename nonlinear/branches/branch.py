"""A branch of a response curve: its points, peaks and bifurcations, and why it ended."""

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

from nonlinear.branches.growth_along_branch import locate_pattern_change, with_patterns, with_wave_exponents
from nonlinear.branches.records import BifurcationKind, TerminationReason
from nonlinear.branches.special_points import locate_bifurcations, locate_peak
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.solution_point import SolutionPoint


class BranchBifurcation(NamedTuple):
    """A bifurcation of a branch: its kind, its place among the points, and the nodal diameter of the perturbation."""

    kind: BifurcationKind
    place: int
    nodal_diameter: int = 0


class Branch(NamedTuple):
    """Points of a branch."""

    points: list[SolutionPoint]  # in the order of growing arc length
    peak_indices: list[int]  # indices of the peaks among the points
    bifurcations: list[BranchBifurcation]  # bifurcations, in the order of the points
    termination: TerminationReason  # why the continuation ended

    def reversed(self) -> "Branch":
        """The same branch in the opposite direction."""
        last = len(self.points) - 1
        peaks = [last - index for index in reversed(self.peak_indices)]
        bifurcations = [item._replace(place=last - item.place) for item in reversed(self.bifurcations)]
        return Branch(reverse(self.points), peaks, bifurcations, self.termination)


def with_special_points(
    continuation: Continuation, points: list[SolutionPoint], termination: TerminationReason
) -> Branch:
    """The branch of these points, with its peaks and bifurcations located and inserted."""
    points = with_wave_exponents(continuation.recorder, points)
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
                branch.bifurcations.append(BranchBifurcation(kind, index))
        branch.points.append(after)
    return _with_growth_in_ring(continuation, branch)


def with_stability(continuation: Continuation, branch: Branch) -> Branch:
    """A branch solved without exponents, with the exponents of its points and the bifurcations that follow from them.

    Folds, known without exponents, are located again, so that all bifurcations are in order.
    """
    folds, peaks = {item.place for item in branch.bifurcations}, set(branch.peak_indices)
    folds -= {*peaks, 0, len(branch.points) - 1}
    kept = [index for index in range(len(branch.points)) if index not in folds]
    points = [branch.points[index] for index in kept]
    exact = [place for place, index in enumerate(kept) if index in peaks]
    points = with_wave_exponents(continuation.recorder, points, exact)
    result = Branch([], [], [], branch.termination)
    for index, after in zip(kept, points, strict=True):
        if result.points:
            before, current = result.points[-1], continuation.with_balance(after.balance)
            for kind, special in sorted(locate_bifurcations(current, before, after), key=lambda item: item[1].arc):
                place = _insert(result.points, special, before, after)
                result.bifurcations.append(BranchBifurcation(kind, place))
        if index in peaks:
            result.peak_indices.append(len(result.points))
        result.points.append(after)
    return _with_growth_in_ring(continuation, result)


def _with_growth_in_ring(continuation: Continuation, branch: Branch) -> Branch:
    """The branch with the exponents of all nodal diameters, and the bifurcations that follow from them inserted."""
    stability = continuation.stability
    if stability is None or not branch.points or not stability.has_patterns(branch.points[0]):
        return branch
    result, known = branch._replace(points=[], peak_indices=[], bifurcations=[]), list(branch.bifurcations)
    for index, after in enumerate(with_patterns(stability, branch.points, branch.peak_indices)):
        if result.points:
            before = result.points[-1]
            change = locate_pattern_change(continuation.with_balance(after.balance), before, after)
            if change is not None:
                kind, nodal_diameter, special = change
                place = _insert(result.points, special, before, after)
                result.bifurcations.append(BranchBifurcation(kind, place, nodal_diameter))
        if index in branch.peak_indices:
            result.peak_indices.append(len(result.points))
        while known and known[0].place == index:
            result.bifurcations.append(known.pop(0)._replace(place=len(result.points)))
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
