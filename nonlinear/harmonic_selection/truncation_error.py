"""Truncation error of a solved branch: its highest point is followed to more harmonics, and the way to it retraced.

With more harmonics a high response may detach from the curve: the curve turns below it, and the peak lies on an
isolated branch. The peak alone, followed to more harmonics, does not tell; the way to it does. A branch with more
harmonics is a shifted copy of the branch with few, until it parts from it. Where the shift is known at both ends of a
part of the way, and in its middle is what these two let expect, no step between needs to be solved.

References
----------
P. J. Roache, "Perspective: a method for uniform reporting of grid refinement studies", J. Fluids Eng. 116(3), 1994,
pp. 405-413.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Literal

import numpy as np

from nonlinear.continuation.acceptance import passes_through
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.response_quantities import output_amplitude
from nonlinear.continuation.solution_point import SolutionPoint, Tangent
from nonlinear.harmonic_balance.initial_solution import TruncatedBalances, pad_or_truncate
from nonlinear.harmonic_selection.peak_following import (
    LINEAR_CHANGE,
    FollowedPeak,
    PeakFollower,
    WorkLimit,
    reference_harmonics,
)
from nonlinear.response_curve import at_range_end

LONGEST_PART = 8  # points of the longest part of the way that is checked at its ends and in its middle only
SAME_SHIFT = 0.25  # distance from the expected shift, relative to the step of the branch there, that is none
SAME_DIRECTION = 0.5  # the same relative to the shift: beyond a resonance of the added harmonics it is reversed
NEGLIGIBLE_SHIFT = 1e-4  # relative to the vibration
SHORTEST_PART = 2  # points

Refit = Callable[[SolutionPoint, Tangent | None], SolutionPoint | None]
TruncationBranch = Literal["kept", "detached", "lost", ""]
SAFETY_FACTOR = 1.25  # of solutions on three grids (Roache 1994)
SAMPLED_POINTS = 6  # along a curve, beside its peaks, where `along_curve` estimates the error
SMOOTH_ERROR = 0.05  # error up to which a peak without folds beside it cannot detach
SAME_HEIGHT = 0.97  # ratio of two amplitudes that count as equal: a retrace does not locate its peaks
FOLLOWING, SAMPLING, RETRACING = (
    (0.5, 100),
    (1.0, 100),
    (2.0, 100),
)  # points that may be solved for: share of those of the curve, and least


@dataclass
class WaySampling:
    """The branch with more harmonics at points of the way, solved where it is asked for."""

    # the way with few harmonics, from its start to the peak; tangents towards the peak
    points: Sequence[SolutionPoint]
    # the solution with more harmonics in the normal plane of a point, from a shift on; None if it is not found
    refit: Refit
    _solved: dict[int, SolutionPoint | None] = field(default_factory=dict, init=False, repr=False)

    @property
    def last(self) -> int:
        """Place of the peak."""
        return len(self.points) - 1

    def solved_up_to(self, place: int) -> list[SolutionPoint]:
        """The solutions so far, up to a place, in the order of the way."""
        found = (self._solved[each] for each in sorted(self._solved) if each <= place)
        return [solution for solution in found if solution is not None]

    def solution(self, place: int, like: Tangent | None = None) -> SolutionPoint | None:
        """The solution with more harmonics at a place; None if it is not found. `like`: the shift to start from."""
        if place not in self._solved:
            self._solved[place] = self.refit(self.points[place], like)
        return self._solved[place]

    def reached_from(self, start: int) -> int:
        """The last place that lies on the branch of the solution at `start` without doubt.

        A part of the way is halved until the shift in its middle is the mean of those at its ends. The sign of the
        bordered determinant is constant along a branch; where it changes between two solutions, they lie on two
        branches.
        """
        n_parts = max(1, round((self.last - start) / LONGEST_PART))
        ends = np.linspace(start, self.last, n_parts + 1).astype(int).tolist()
        reached, parts = start, list(pairwise(ends))[::-1]
        while parts:
            first, after = parts.pop()
            if self._certain(first, after):
                reached = after
            elif after - first < 2 * SHORTEST_PART:
                break
            else:
                middle = (first + after) // 2
                parts += [(middle, after), (first, middle)]
        return reached

    def _certain(self, first: int, after: int) -> bool:
        """Whether the solutions at both ends of a part lie on one branch without doubt."""
        if self.solution(first) is None:
            return False
        self.solution(after, self._shift(first))
        if not self._on_one_branch(first, after):
            return False
        return after - first > 1 and self._as_expected(first, (first + after) // 2, after)

    def targets_beyond(self, place: int) -> dict[int, SolutionPoint]:
        """Some solutions beyond a place, by their places: 2, 8, 32, ... points farther on, and the last one."""
        places = [place + 2**power for power in range(1, 16, 2) if place + 2**power < self.last]
        found = {each: self.solution(each) for each in (*places, self.last)}
        return {each: solution for each, solution in found.items() if solution is not None}

    def _on_one_branch(self, first: int, after: int) -> bool:
        """Whether both are found, with one sign of the bordered determinant."""
        one, other = self.solution(first), self.solution(after)
        return one is not None and other is not None and one.bordered_sign == other.bordered_sign

    def _as_expected(self, first: int, middle: int, after: int) -> bool:
        """Whether the shift in the middle is interpolated between the ends, relative to the steps of the branch."""
        to_middle, whole = (abs(self.points[place].arc - self.points[first].arc) for place in (middle, after))
        share = to_middle / whole if whole > 0.0 else 0.5
        (x_first, omega_first), (x_after, omega_after) = self._shift(first), self._shift(after)
        expected = (1.0 - share) * x_first + share * x_after, (1.0 - share) * omega_first + share * omega_after
        self.solution(middle, expected)
        if not (self._on_one_branch(first, middle) and self._on_one_branch(middle, after)):
            return False
        metric, found = self.points[middle].metric, self._shift(middle)
        error = metric.norm(found[0] - expected[0], found[1] - expected[1])
        step = max(abs(self.points[middle + side].arc - self.points[middle].arc) for side in (-1, 1))
        shift = max(metric.norm(*each) for each in (found, self._shift(first), self._shift(after)))
        return error <= NEGLIGIBLE_SHIFT or error <= min(SAME_SHIFT * step, SAME_DIRECTION * shift)

    def _shift(self, place: int) -> Tangent:
        point, solution = self.points[place], self.solution(place)
        assert solution is not None
        return solution.unknown - pad_or_truncate(point.unknown, solution.balance), solution.omega - point.omega


@dataclass(frozen=True)
class WayToPeak:
    """The shorter side of a peak, from a linear segment or an end of the curve to the peak."""

    points: Sequence[SolutionPoint]  # from the first point to the peak, tangents towards the peak
    # lowest and highest frequency of the peak and of the ends of both its sides, rad/s
    omega_range: tuple[float, float]
    indices: range  # indices of the points on both sides
    has_folds: bool  # whether there are folds on either side

    @property
    def rising(self) -> bool:
        """Whether the frequency rises at the first point."""
        return self.points[0].tangent[1] > 0.0


@dataclass(frozen=True)
class Retrace:
    """What the branch with more harmonics does on the way to a peak."""

    reached: bool | None  # whether it passes through the peak; None where the retrace ends before that is known
    amplitude: float  # its highest amplitude on the way, m
    omega: float  # frequency there, rad/s


def way_to_peak(continuation: Continuation, points: Sequence[SolutionPoint], index: int) -> WayToPeak:
    """The shorter side of the peak with this index.

    On a linear segment all numbers of harmonics give the same response: the branch is the same there.
    """
    left = next((place for place in range(index - 1, 0, -1) if continuation.is_linear(points[place])), 0)
    last = len(points) - 1
    right = next((place for place in range(index + 1, last) if continuation.is_linear(points[place])), last)
    if index - left <= right - index:
        way = list(points[left : index + 1])
    else:
        way = [point.reversed() for point in reversed(points[index : right + 1])]
    frequencies = [points[place].omega for place in (left, index, right)]
    indices = range(left, right + 1)
    has_folds = len({points[place].jacobian_sign for place in indices}) > 1
    return WayToPeak(way, (min(frequencies), max(frequencies)), indices, has_folds)


def retrace(way: WayToPeak, wider: Continuation, follower: PeakFollower, work: WorkLimit) -> Retrace:
    """Follow the branch with the harmonics of `wider` along the way to the peak.

    Points of the way are solved with more harmonics. Where they do not lie on one branch without doubt, the branch is
    continued until it passes through one of the next of them. It passes below the peak where it leaves the
    frequencies of the way on the other side on a linear segment, or the frequency range.
    """

    def refit(point: SolutionPoint, shift: Tangent | None) -> SolutionPoint | None:
        if follower.work.exhausted:
            return None
        if shift is not None:
            point = point.with_balance(wider.balance)
            point = replace(point, unknown=point.unknown + shift[0], parameter=point.omega + shift[1])
        return follower.refit(wider, point)

    amplitude = follower.amplitude
    sampling = WaySampling(way.points, refit)
    place = 0
    if sampling.solution(0) is None:
        return Retrace(None, 0.0, way.points[0].omega)
    top = (0.0, way.points[0].omega)
    while True:
        place = sampling.reached_from(place)
        top = max(top, *((amplitude(point), point.omega) for point in sampling.solved_up_to(place)))
        if place == sampling.last:
            return Retrace(True, *top)
        start = sampling.solution(place)
        assert start is not None
        found, next_place = _continued(wider, way, start, sampling.targets_beyond(place), amplitude, work)
        top = max(top, (found.amplitude, found.omega))
        if next_place is None:
            return Retrace(found.reached, *top)
        place = next_place


def _continued(
    wider: Continuation,
    way: WayToPeak,
    start: SolutionPoint,
    targets: dict[int, SolutionPoint],
    amplitude: Callable[[SolutionPoint], float],
    work: WorkLimit,
) -> tuple[Retrace, int | None]:
    """The same by continuation, and the place of the first of the targets that the branch passes through, if any."""
    before, top = start, (amplitude(start), start.omega)
    for point in work.branch(wider, start):
        height = amplitude(point)
        top = max(top, (height, point.omega))
        for place, target in targets.items():
            if any(passes_through(wider.solver, before, point, each) for each in (target, target.reversed())):
                return Retrace(None, *top), place
        beyond = point.omega > way.omega_range[1] if way.rising else point.omega < way.omega_range[0]
        if beyond and point.linear is not None:
            return Retrace(False, *top), None
        before = point
    left_range = before is not start and at_range_end(before.omega, wider.options.omega_range)
    return Retrace(False if left_range else None, *top), None


@dataclass(frozen=True)
class TruncationEstimate:
    """Estimated errors of the highest amplitude of a branch by neglected harmonics."""

    # relative error of the highest amplitude of the branch; NaN without an estimate, inf where nothing was found with
    # more harmonics
    error: float = float("nan")
    # "kept": with more harmonics the peak lies on the branch too. "detached": it lies on a detached branch then, and
    # the branch itself is lower; `error` compares with its highest amplitude. "lost": the peak, or the branch on the
    # way to it, was not followed to more harmonics, and the error may be larger than estimated. "": no estimate
    branch: TruncationBranch = ""
    omega: float = float("nan")  # frequency of the highest amplitude of the branch with the most harmonics, rad/s
    # relative error of the amplitude of the motion at the peak, on whatever branch it lies with more harmonics
    motion_error: float = float("nan")


@dataclass(frozen=True)
class TruncationErrorEstimator:
    """Estimates the error of the amplitude by neglected harmonics at the points of a curve."""

    continuation: Continuation  # the continuation of the curve
    balances: TruncatedBalances  # the balances with other numbers of harmonics

    def of_branch(
        self, points: Sequence[SolutionPoint], peak_indices: Sequence[int], main: bool = True
    ) -> TruncationEstimate:
        """Truncation error of the highest amplitude of a branch.

        The peak is continued to H + 2 harmonics, to H' = `reference_harmonics` of H, and to `reference_harmonics` of
        H'. With the relative changes d1, d2, d3 of the amplitude from each to the next, the estimate is

            1.25 (d1 + d2 + 2 d3).

        Changes are summed, since amplitudes that alternate are farther from their limit than the last change. The
        last one counts twice, as if each later change were half of the one before. 1.25 is the safety factor of
        Roache (1994). Where the peak is lost, the highest amplitude with more harmonics on both sides of it takes its
        place.

        On the main branch the way to the peak is then retraced with more harmonics. Where the branch passes below the
        peak, the peak has detached: 1.25 times the relative difference from the highest amplitude of the branch is
        the estimate, if that is larger.
        """
        if not points:
            return TruncationEstimate()
        index = self.highest(points, peak_indices)
        point, amplitude = points[index], self._amplitude(points[index])
        if amplitude == 0.0:
            return TruncationEstimate(0.0, "kept", point.omega, 0.0)
        is_peak = index in peak_indices or not at_range_end(point.omega, self.continuation.options.omega_range)
        followed = list(self._follower(points, point, FOLLOWING).follow(point, is_peak))
        motion = _error_of_sequence([amplitude, *(found.amplitude for found in followed)])
        estimate = TruncationEstimate(motion, "lost", motion_error=motion)
        if followed:
            branch: TruncationBranch = "kept" if followed[-1].refitted else "lost"
            estimate = replace(estimate, branch=branch, omega=followed[-1].point.omega)
        if not main or index not in peak_indices or motion <= LINEAR_CHANGE:
            return estimate
        return self._with_way(estimate, points, peak_indices, followed)

    def _with_way(
        self,
        estimate: TruncationEstimate,
        points: Sequence[SolutionPoint],
        peak_indices: Sequence[int],
        followed: Sequence[FollowedPeak],
    ) -> TruncationEstimate:
        """The estimate after the way to the highest peak was retraced with more harmonics."""
        index = max(peak_indices, key=lambda place: self._amplitude(points[place]))
        way = way_to_peak(self.continuation, points, index)
        if estimate.branch == "kept" and not way.has_folds and estimate.error <= SMOOTH_ERROR:
            return estimate
        n_harmonics = points[index].balance.n_harmonics + 2
        same = [found for found in followed if found.point.balance.n_harmonics == n_harmonics]
        follower = self._follower(points, points[index], SAMPLING)
        work = self._follower(points, points[index], RETRACING).work
        found = retrace(way, follower.with_harmonics(n_harmonics), follower, work)
        if found.reached is None:
            return replace(estimate, branch="lost")
        elsewhere = [points[place] for place in (0, len(points) - 1, *peak_indices) if place not in way.indices]
        tops = [(found.amplitude, found.omega), *((self._amplitude(point), point.omega) for point in elsewhere)]
        height, omega = max(tops)
        of_branch = _error_of_sequence([self._amplitude(points[index]), height])
        if not followed:
            return TruncationEstimate(of_branch, "kept", omega, of_branch)
        if not found.reached and height < SAME_HEIGHT * max((each.amplitude for each in same), default=0.0):
            return replace(estimate, error=max(estimate.error, of_branch), branch="detached", omega=omega)
        if not found.reached or height * SAME_HEIGHT > followed[-1].amplitude:  # the branch has another highest point
            return replace(estimate, error=max(estimate.error, of_branch), branch="kept", omega=omega)
        return replace(estimate, branch="kept")

    def along_curve(self, points: Sequence[SolutionPoint], peak_indices: Sequence[int]) -> dict[int, float]:
        """Changes of the amplitude with more harmonics, relative to the highest amplitude, by indices of points.

        They are evaluated at the peaks and at some other points, but not where the ring leaves the motion; inf where
        one is lost.
        """
        if not points:
            return {}
        amplitudes = [self._amplitude(point) for point in points]
        highest = max(amplitudes)
        if highest == 0.0:
            return dict.fromkeys(peak_indices, 0.0)
        spread = np.unique(np.linspace(0, len(points) - 1, SAMPLED_POINTS).astype(int)).tolist()
        sampled = sorted({*peak_indices, *spread, int(np.argmax(amplitudes))})
        return {
            place: abs(self._reference_amplitude(points[place]) - amplitudes[place]) / highest
            for place in sampled
            if points[place].pattern is None
        }

    def highest(self, points: Sequence[SolutionPoint], peak_indices: Sequence[int]) -> int:
        """Index of the highest amplitude of a branch with points, among its peaks and its ends.

        Among all points where these are clearly lower: a change of the harmonics may hide a peak.
        """
        heights = [self._amplitude(point) for point in points]
        located = max((*peak_indices, 0, len(points) - 1), key=heights.__getitem__)
        top = max(range(len(points)), key=heights.__getitem__)
        return located if heights[located] >= SAME_HEIGHT * heights[top] else top

    def _amplitude(self, point: SolutionPoint) -> float:
        return output_amplitude(point, self.continuation.options.output)

    def _follower(
        self, points: Sequence[SolutionPoint], peak: SolutionPoint, limit: tuple[float, int]
    ) -> PeakFollower:
        """A follower that may solve for a share of the points of the curve, and for a least number."""
        work = WorkLimit(peak.balance.n_harmonics, 0.0)
        for point in points:
            if point.linear is None:
                work.spend(point.balance.n_harmonics)
        work.left = max(-limit[0] * work.left, limit[1])
        return PeakFollower(self.continuation, self.balances, work)

    def _reference_amplitude(self, point: SolutionPoint) -> float:
        """Amplitude with more harmonics, in the plane normal to the curve through the point; inf if not found."""
        if point.linear is not None:  # a linear motion has no more harmonics
            return self._amplitude(point)
        follower = PeakFollower(self.continuation, self.balances, WorkLimit(point.balance.n_harmonics, 1.0))
        wider = follower.with_harmonics(reference_harmonics(point.balance.n_harmonics))
        found = wider.solver.refit(point)
        return float("inf") if found is None else self._amplitude(found)


def _error_of_sequence(amplitudes: Sequence[float]) -> float:
    """1.25 (d1 + d2 + ... + 2 dn) with the relative changes d of the amplitudes; inf for a single one."""
    changes = [abs(before / after - 1.0) for before, after in pairwise(amplitudes)]
    return SAFETY_FACTOR * (sum(changes) + changes[-1]) if changes else float("inf")
