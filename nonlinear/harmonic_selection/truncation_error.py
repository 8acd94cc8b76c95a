"""Truncation error of a solved branch: its highest point is followed to more harmonics, and the way to it retraced.

References
----------
P. J. Roache, "Perspective: a method for uniform reporting of grid refinement studies", J. Fluids Eng. 116(3), 1994,
pp. 405-413.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np

from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.response_quantities import output_amplitude
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.truncated_balances import TruncatedBalances
from nonlinear.harmonic_selection.branch_retrace import is_limit, retrace, way_to_peak
from nonlinear.harmonic_selection.peak_following import FollowedPeak, PeakFollower, reference_harmonics
from nonlinear.harmonic_selection.work_limit import WorkLimit

TruncationBranch = Literal["kept", "detached", "lost", ""]

SAFETY_FACTOR = 1.25  # of solutions on three grids (Roache 1994)
SAMPLED_POINTS = 6  # along a curve, beside its peaks, where `along_curve` estimates the error
LINEAR_CHANGE = 1e-12  # relative change of a response that is linear
SMOOTH_ERROR = 0.05  # error up to which a peak without folds beside it cannot detach
SAME_HEIGHT = 0.97  # ratio of two amplitudes that count as equal: a retrace does not locate its peaks
FOLLOWING, SAMPLING, RETRACING = (
    (0.5, 100),
    (1.0, 100),
    (2.0, 100),
)  # points that may be solved for: share of those of the curve, and least


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
        is_peak = index in peak_indices or not is_limit(point.omega, self.continuation.options.omega_range)
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

        They are evaluated at the peaks and at some other points; inf where one is lost.
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
            place: abs(self._reference_amplitude(points[place]) - amplitudes[place]) / highest for place in sampled
        }

    def highest(self, points: Sequence[SolutionPoint], peak_indices: Sequence[int]) -> int:
        """Index of the highest amplitude of a branch with points, among its peaks and its ends."""
        return max((*peak_indices, 0, len(points) - 1), key=lambda place: self._amplitude(points[place]))

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
        follower = PeakFollower(self.continuation, self.balances, WorkLimit(point.balance.n_harmonics, 1.0))
        wider = follower.with_harmonics(reference_harmonics(point.balance.n_harmonics))
        found = wider.solver.refit(point)
        return float("inf") if found is None else self._amplitude(found)


def _error_of_sequence(amplitudes: Sequence[float]) -> float:
    """1.25 (d1 + d2 + ... + 2 dn) with the relative changes d of the amplitudes; inf for a single one."""
    changes = [abs(before / after - 1.0) for before, after in pairwise(amplitudes)]
    return SAFETY_FACTOR * (sum(changes) + changes[-1]) if changes else float("inf")
