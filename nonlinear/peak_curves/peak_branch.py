"""A followed peak as a function of the parameter: pieces between its folds, interpolated with their derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nonlinear.contact.parameters import Array
from nonlinear.peak_curves.peak_curve import PeakContinuation, PeakPoint


@dataclass(frozen=True)
class PeakPiece:
    """Peaks over a parameter between two folds of the curve of peaks.

    Attributes
    ----------
    points : tuple of PeakPoint
        Peaks by growing share.
    origin : str
        Branch of the response that it was found on.
    """

    points: tuple[PeakPoint, ...]
    origin: str

    @property
    def share(self) -> Array:
        """Shares of the range, ascending, (P,)."""
        return np.array([point.share for point in self.points])

    @property
    def amplitude(self) -> Array:
        """Amplitudes, m, (P,)."""
        return np.array([point.amplitude for point in self.points])

    @property
    def rate(self) -> Array:
        """Derivatives of the amplitude with respect to the share, m, (P,)."""
        return np.array([point.rate for point in self.points])

    def holds(self, share: float) -> bool:
        """Whether a share lies on it."""
        return bool(self.points[0].share <= share <= self.points[-1].share)

    def amplitude_at(self, shares: Array) -> Array:
        """Amplitude at some shares, NaN beyond the ends: the cubic with the values and derivatives of the peaks."""
        from scipy.interpolate import CubicHermiteSpline

        return np.asarray(CubicHermiteSpline(self.share, self.amplitude, self.rate, extrapolate=False)(shares))

    def nearest(self, share: float) -> PeakPoint:
        """The followed peak with the nearest share."""
        return self.points[int(np.argmin(np.abs(self.share - share)))]


def follow_peak(follower: PeakContinuation, start: PeakPoint, origin: str) -> list[PeakPiece]:
    """The curve of peaks through one peak, both ways, in pieces between its folds."""
    back = list(follower.points(start, -1.0))
    points = [*reversed(back), start, *follower.points(start, 1.0)]
    return pieces(points, origin)


def pieces(points: Sequence[PeakPoint], origin: str) -> list[PeakPiece]:
    """Points along a curve of peaks split where the parameter turns back, and where they are no maxima."""
    found: list[PeakPiece] = []
    current: list[PeakPoint] = []
    direction = 0.0
    for point in points:
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
    ordered = points if points[-1].share > points[0].share else points[::-1]
    return [PeakPiece(tuple(ordered), origin)]
