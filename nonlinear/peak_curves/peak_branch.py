"""A followed peak as a function of the parameter: pieces between its folds, interpolated with their derivatives, and
where along them the motion persists.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.parameters import Array
from nonlinear.continuation.point_stability import PointStability
from nonlinear.harmonic_balance.initial_solution import TruncatedBalances
from nonlinear.peak_curves.peak_curve import PeakContinuation, PeakPoint
from nonlinear.worst_motion.candidates import LONG

if TYPE_CHECKING:
    from scipy.interpolate import CubicHermiteSpline


CHANGE = 1e-6  # of the share, to which a change is located
INTERPOLATION = 2e-4  # largest relative error of the cubic between two followed peaks
FINEST = 5e-4  # of the share, distance of two peaks below which none is added between
BEYOND = 0.1  # relative difference from the range of its neighbours beyond which it is another peak


@dataclass(frozen=True)
class PeakStability:
    """Stability of followed peaks, counted as in the worst motion of a response (`candidates.persists`)."""

    follower: PeakContinuation  # the family of problems

    def judged(self, peak: PeakPoint) -> PeakPoint:
        """The peak with its largest growth rate, and whether it persists.

        With the option `stability` "folds" only the sign of det dR/dx tells.
        """
        _, contact, _, options = self.follower.family.at(peak.share)
        point = peak.point
        if options.stability == "folds":
            return replace(peak, persists=point.stable)
        balances = TruncatedBalances(point.balance, contact, options)
        stability = PointStability(contact, balances, options.stability == "ring")
        point = replace(point, contact=point.balance.element.evaluate(point.displacement))
        point = replace(point, exponents=stability.exponents(point))
        if stability.has_patterns(point):
            point = replace(point, pattern=stability.worst_pattern(point))
        slow = point.growth_rate * LONG < peak.frequency_hz
        return replace(peak, growth_rate=point.growth_rate, persists=point.stable or slow)

    def with_changes(self, peaks: Sequence[PeakPoint]) -> list[PeakPoint]:
        """Judged peaks by growing share, with two more at each change: the last before it, the first after it."""
        found = list(peaks[:1])
        for before, after in pairwise(peaks):
            if before.persists != after.persists:
                found += [peak for peak in self._change(before, after) if before.share < peak.share < after.share]
            found.append(after)
        return found

    def _change(self, before: PeakPoint, after: PeakPoint) -> tuple[PeakPoint, PeakPoint]:
        """The two peaks on either side of a change, by bisection; as near to it as peaks were found."""
        while after.share - before.share > CHANGE:
            nearer = before if before.share > after.share - 0.1 else after
            middle = self.follower.moved(nearer, 0.5 * (before.share + after.share))
            if middle is None:
                break
            middle = self.judged(middle)
            before, after = (middle, after) if middle.persists == before.persists else (before, middle)
        return before, after


@dataclass(frozen=True)
class PeakPiece:
    """Peaks over a parameter between two folds of the curve of peaks."""

    points: tuple[PeakPoint, ...]  # peaks by growing share
    origin: str  # branch of the response that it was found on

    @cached_property
    def share(self) -> Array:
        """Shares of the range, ascending, (P,)."""
        return np.array([point.share for point in self.points])

    @cached_property
    def amplitude(self) -> Array:
        """Amplitudes, m, (P,)."""
        return np.array([point.amplitude for point in self.points])

    @cached_property
    def rate(self) -> Array:
        """Derivatives of the amplitude with respect to the share, m, (P,)."""
        return np.array([point.rate for point in self.points])

    @cached_property
    def frequency_hz(self) -> Array:
        """Frequencies, Hz, (P,)."""
        return np.array([point.frequency_hz for point in self.points])

    @cached_property
    def persists(self) -> NDArray[np.bool_]:
        """Whether the motions persist, (P,)."""
        return np.array([point.persists for point in self.points], dtype=bool)

    def holds(self, share: float) -> bool:
        """Whether a share lies on it."""
        return bool(self.points[0].share <= share <= self.points[-1].share)

    @cached_property
    def _cubic(self) -> CubicHermiteSpline:
        from scipy.interpolate import CubicHermiteSpline

        return CubicHermiteSpline(self.share, self.amplitude, self.rate, extrapolate=False)

    @cached_property
    def _slope(self) -> CubicHermiteSpline:
        return self._cubic.derivative()

    def amplitude_at(self, shares: Array) -> Array:
        """Amplitude at some shares, NaN beyond the ends: the cubic with the values and derivatives of the peaks."""
        return np.asarray(self._cubic(shares))

    def rate_at(self, shares: Array) -> Array:
        """Derivative of that amplitude with respect to the share, m."""
        return np.asarray(self._slope(shares))

    def persistent_at(self, shares: Array) -> Array:
        """As `amplitude_at`, NaN where the motion does not persist: between two peaks of which one does not."""
        values, persists = self.amplitude_at(shares), self.persists
        after = np.clip(np.searchsorted(self.share, shares, side="right"), 1, len(self.points) - 1)
        both = persists[after - 1] & persists[after]
        exact = ((shares == self.share[after - 1]) & persists[after - 1]) | (
            (shares == self.share[after]) & persists[after]
        )
        return np.where(both | exact, values, np.nan)

    def nearest(self, share: float) -> PeakPoint:
        """The followed peak with the nearest share."""
        return self.points[int(np.argmin(np.abs(self.share - share)))]


def follow_peak(follower: PeakContinuation, start: PeakPoint, origin: str) -> list[PeakPiece]:
    """The curve of peaks through one peak, both ways, in pieces between its folds, with the stability of each."""
    back = list(follower.points(start, -1.0))
    points = [*reversed(back), start, *follower.points(start, 1.0)]
    stability = PeakStability(follower)
    return [_judged(follower, stability, piece) for piece in pieces(points, origin)]


def _judged(follower: PeakContinuation, stability: PeakStability, piece: PeakPiece) -> PeakPiece:
    """A piece that its cubic interpolates well, with the stability of its peaks."""
    points = list(piece.points[:1])
    for before, after in pairwise(piece.points):
        points += [*_between(follower, before, after, piece.origin), after]
    judged = [stability.judged(point) for point in points]
    return PeakPiece(tuple(_ascending(stability.with_changes(judged))), piece.origin)


def _between(follower: PeakContinuation, before: PeakPoint, after: PeakPoint, origin: str) -> list[PeakPoint]:
    """Peaks between two, until the cubic is as good as `INTERPOLATION` in the middle of each gap."""
    if after.share - before.share < FINEST:
        return []
    found = _middle(follower, before, after)
    if found is None:
        return []
    cubic = float(PeakPiece((before, after), origin).amplitude_at(np.array([found.share]))[0])
    if abs(cubic / found.amplitude - 1.0) <= INTERPOLATION:
        return [found]
    return [*_between(follower, before, found, origin), found, *_between(follower, found, after, origin)]


def _middle(follower: PeakContinuation, before: PeakPoint, after: PeakPoint) -> PeakPoint | None:
    """A peak between two neighbours: at the middle share, else half a step along the curve of peaks from either."""
    share = 0.5 * (before.share + after.share)
    low, high = sorted((before.amplitude, after.amplitude))
    slack = BEYOND * high
    for start, other in ((before, after), (after, before)):
        for found in (follower.moved(start, share), follower.half_way(start, other)):
            if found is None or not found.is_maximum or not before.share < found.share < after.share:
                continue
            if low - slack <= found.amplitude <= high + slack:
                return found
    return None


def pieces(points: Sequence[PeakPoint], origin: str) -> list[PeakPiece]:
    """Points along a curve of peaks split where the parameter turns back, and where they are no maxima."""
    found: list[PeakPiece] = []
    current: list[PeakPoint] = []
    direction = 0.0
    for point in points:
        if point.is_fold:
            found += _piece([*current, point], origin)
            current, direction = [point], 0.0
            continue
        step = 0.0 if not current else float(np.sign(point.share - current[-1].share))
        if current and (not point.is_maximum or (direction != 0.0 and step != direction)):
            found += _piece(current, origin)
            current, step = [], 0.0
        direction = step
        if point.is_maximum:
            current.append(point)
    return found + _piece(current, origin)


def _piece(points: list[PeakPoint], origin: str) -> list[PeakPiece]:
    if len(points) < 2:
        return []
    ordered = _ascending(points if points[-1].share > points[0].share else points[::-1])
    return [PeakPiece(tuple(ordered), origin)] if len(ordered) > 1 else []


def _ascending(points: Sequence[PeakPoint]) -> list[PeakPoint]:
    """The points without those whose parameter does not exceed that of the one before, which no cubic can take."""
    found = list(points[:1])
    for point in points[1:]:
        if point.share > found[-1].share:
            found.append(point)
    return found
