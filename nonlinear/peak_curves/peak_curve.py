"""A peak of the response followed over a parameter, folds of the peak included.

The solutions (x, omega) of all problems of a family are a surface over the parameter share s. Around a solution it
has the coordinates (alpha, beta): alpha is the arc length along the response curve, beta the change of s. A point of
it is solved for in the plane normal to the response curve at the base. A peak is a zero of

    g(alpha, beta) = dA/darc / A,

the derivative of the amplitude along the response curve of the same s. The peaks of all s are a curve on the surface,
followed by pseudo-arc-length in (alpha, beta): predicted along its tangent, corrected by Newton's method in its
normal direction. Where the peak turns back in the parameter (an isolated branch is born there), the curve goes on.

References
----------
T. Detroux, L. Renson, L. Masset, G. Kerschen, "The harmonic balance method for bifurcation analysis of large-scale
nonlinear mechanical systems", Computer Methods in Applied Mechanics and Engineering 296 (2015) 18-38.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple, Protocol, TypeVar

import numpy as np

from nonlinear.branches.parameter_continuation import rate_of_change
from nonlinear.contact.parameters import Array, ContactError
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.response_quantities import amplitude_derivative, output_amplitude
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.continuation.step_control import IterationControl, Step, follow
from nonlinear.continuation.zero_bracket import ZeroBracket
from nonlinear.options import Measure, OptionsError
from nonlinear.peak_curves.parameter_family import ParameterFamily

DIFFERENCE = 1e-5  # of alpha and of s, for the slopes of g
TOLERANCE = 1e-10  # of g: the relative change of amplitude over unit arc length
ITERATIONS = 12
STEPS = IterationControl(first=0.02, largest=0.15, smallest=1e-4, few=6, many=10)  # in (alpha, beta)
MOST_POINTS, MOST_FOLDS = 300, 12
SMALLEST_SHARE = 1.0 / 64.0  # of a way, by which a motion is carried at least
LARGEST_CHANGE = (
    0.3  # relative change of the amplitude in one step of that way, beyond which it may be another motion
)
NEAR_END = 1e-3  # of the share
AT_FOLD, FOLD_ITERATIONS = 3e-3, 12  # part of the unit tangent along the parameter that counts as none


@dataclass(frozen=True)
class PeakPoint:
    """A peak at one share of the parameter range."""

    share: float  # share s of the range
    point: SolutionPoint  # the peak
    amplitude: float  # amplitude of the output, m
    rate: float  # derivative of the amplitude with respect to the share, at the peak, m
    slopes: tuple[float, float]  # derivatives of g with respect to alpha and beta
    tangent: tuple[float, float]  # unit tangent (alpha, beta) of the curve of peaks
    growth_rate: float = float("nan")  # largest real part of the Floquet exponents, 1/s; NaN where not computed
    persists: bool = True  # whether the motion persists; see `PeakStability`. True where not computed

    @property
    def frequency_hz(self) -> float:
        """Frequency, Hz."""
        return float(self.point.omega / (2.0 * np.pi))

    @property
    def is_fold(self) -> bool:
        """Whether the curve of peaks turns back in the parameter there."""
        return abs(self.tangent[1]) < AT_FOLD

    @property
    def is_maximum(self) -> bool:
        """Whether the amplitude has a maximum over the frequency there, not a minimum or an inflection."""
        return self.slopes[0] < 0.0


class Stationary(NamedTuple):
    """A solution near a peak or a minimum of the amplitude along its response curve."""

    point: SolutionPoint
    value: float  # g, the relative change of the amplitude over unit arc length; 0 where it is stationary
    amplitude: float  # of the output, m
    is_maximum: bool = False


def stationary_near(
    continuation: Continuation, point: SolutionPoint, measured: tuple[str, Measure] | None = None
) -> Stationary | None:
    """The stationary amplitude of a response curve near a solution; None where Newton's method does not converge.

    `measured`: the output and what is counted of its motion; None: those of the options.
    """
    alpha, found = 0.0, _solved(continuation, point, 0.0, measured)
    for _ in range(ITERATIONS):
        ahead = None if found is None else _solved(continuation, point, alpha + DIFFERENCE, measured)
        if found is None or ahead is None or ahead.value == found.value:
            return None
        if abs(found.value) < TOLERANCE:
            return found._replace(is_maximum=ahead.value < found.value)
        alpha -= found.value * DIFFERENCE / (ahead.value - found.value)
        found = _solved(continuation, point, alpha, measured)
    return None


def _solved(
    continuation: Continuation, point: SolutionPoint, alpha: float, measured: tuple[str, Measure] | None = None
) -> Stationary | None:
    """The solution at a distance along the tangent of a point, with g; None where none is found."""
    x, omega = point.unknown + alpha * point.tangent[0], point.omega + alpha * point.tangent[1]
    found = continuation.solver.refit(replace(point, balance=continuation.balance, unknown=x, parameter=omega))
    if found is None:
        return None
    exact = continuation.solver.point(found.unknown, found.omega, point.tangent, found.iterations, 0.0, point.step)
    measured = measured or (continuation.options.output, continuation.options.measure)
    amplitude = output_amplitude(exact, *measured)
    return Stationary(exact, amplitude_derivative(exact, *measured) / amplitude, amplitude)


class HasAmplitude(Protocol):
    """A motion of a height."""

    @property
    def amplitude(self) -> float:
        """Amplitude of the output, m."""


Carried = TypeVar("Carried", bound=HasAmplitude)


def carried_along(
    start: Carried, moved: Callable[[Carried, float], Carried | None], growth: float = 1.0
) -> Carried | None:
    """A motion carried from the share 0 of a way to 1; None where it was lost.

    `moved`: the motion at a share from one before, None where it is not found. Steps are halved there, and where it
    may be another motion; `growth`: of a step after one that succeeded.
    """

    def carried(state: tuple[float, Carried], length: float) -> Step[tuple[float, Carried]] | float:
        share, before = min(state[0] + length, 1.0), state[1]
        found = moved(before, share)
        if found is None or abs(found.amplitude / before.amplitude - 1.0) > LARGEST_CHANGE:
            return 0.5 * length
        return Step((share, found), length, growth * length, share == 1.0)

    for step in follow((0.0, start), (carried,), (1.0, SMALLEST_SHARE)):
        if step.last:
            return step.state[1]
    return None


@dataclass(frozen=True)
class PeakContinuation:
    """Follows peaks of a family of problems."""

    family: ParameterFamily

    def __post_init__(self) -> None:
        object.__setattr__(self, "_continuation", lru_cache(maxsize=8)(self.family.continuation))

    def continuation(self, share: float) -> Continuation:
        """The continuation in the frequency at a share of the range."""
        found: Continuation = self._continuation(share)  # type: ignore[attr-defined]
        return found

    def peak_near(self, share: float, point: SolutionPoint) -> PeakPoint | None:
        """The peak of the response curve at `share` near a solution; None where Newton's method does not converge."""
        found = stationary_near(self.continuation(share), point)
        return None if found is None else self._peak(share, found.point, (0.0, 1.0))

    def moved(self, peak: PeakPoint, share: float) -> PeakPoint | None:
        """The peak at another share near that of a peak; None where Newton's method does not converge."""
        start = replace(peak.point, balance=self.continuation(share).balance)
        return self.peak_near(share, start)

    def half_way(self, peak: PeakPoint, other: PeakPoint) -> PeakPoint | None:
        """The peak half a step along the curve of peaks from one towards a neighbour; None where none is found."""
        part = other.share - peak.share
        if peak.tangent[1] * part < 0.0:
            peak = replace(peak, tangent=(-peak.tangent[0], -peak.tangent[1]))
        found = None if peak.is_fold else self._step(peak, 0.5 * part / peak.tangent[1])
        return None if found is None else found[0]

    def points(self, start: PeakPoint, direction: float) -> Iterator[PeakPoint]:
        """Peaks after `start`, at first with growing (`direction` +1) or falling (-1) parameter.

        It ends beyond the range of the parameter, at an end of the frequency range, where no next peak is found, and
        after `MOST_FOLDS` folds.
        """
        if start.tangent[1] * direction < 0.0:
            start = replace(start, tangent=(-start.tangent[0], -start.tangent[1]))
        peak, folds = start, 0
        for step in STEPS.follow(start, self._step_in_range, MOST_POINTS):
            found = step.state
            if found.tangent[1] * peak.tangent[1] < 0.0:
                fold = self._fold(peak, found, step.length)
                folds += 1
                if fold is not None:
                    yield fold
            yield found
            if folds > MOST_FOLDS or not 0.0 <= found.share <= 1.0:
                return
            peak = found
        yield from self._end(peak)

    def _step_in_range(self, peak: PeakPoint, step: float) -> tuple[PeakPoint, int] | None:
        """As `_step`; None outside the frequency range too."""
        found, (low, high) = self._step(peak, step), self.family.problem.options.omega_range
        return found if found is not None and low <= found[0].point.omega <= high else None

    def _step(self, peak: PeakPoint, step: float) -> tuple[PeakPoint, int] | None:
        """The next peak at a distance of `step`, and the iterations it took; None where none is found."""
        base = _Base(self, peak.share, peak.point, self._rate(peak))
        tangent = np.array(peak.tangent)
        normal = np.array([-tangent[1], tangent[0]])
        slope = float(normal @ peak.slopes)
        away, last = 0.0, None
        for iteration in range(1, ITERATIONS + 1):
            alpha, beta = step * tangent + away * normal
            found = base.at(float(alpha), float(beta))
            if found is None:
                return None
            if abs(found.value) < TOLERANCE:
                following = self._peak(peak.share + float(beta), found.point, peak.tangent)
                return None if following is None else (following, iteration)
            if last is not None and away != last[0]:
                slope = (found.value - last[1]) / (away - last[0])  # secant
            if slope == 0.0:
                return None
            last = away, found.value
            away -= found.value / slope
            if not abs(away) < step:
                return None
        return None

    def _end(self, peak: PeakPoint) -> Iterator[PeakPoint]:
        """The peak at an end of the range that is near, where the parameter cannot go beyond it."""
        end = round(peak.share)
        if 0.0 < abs(peak.share - end) < NEAR_END:
            found = self.moved(peak, float(end))
            if found is not None and found.is_maximum:
                yield found

    def _fold(self, before: PeakPoint, after: PeakPoint, step: float) -> PeakPoint | None:
        """The peak between two, a distance of `step` apart, at which the parameter turns back; None: not found.

        There the part of the tangent along the parameter changes its sign.
        """
        bracket = ZeroBracket((0.0, before.tangent[1]), (step, after.tangent[1]))
        for _ in range(FOLD_ITERATIONS):
            length = bracket.next_place(0.0)
            found = self._step(before, length)
            if found is None or found[0].is_fold:
                return None if found is None else found[0]
            value = found[0].tangent[1]
            bracket = bracket.narrowed(length, value, value * after.tangent[1] > 0.0)
        return None

    def _rate(self, peak: PeakPoint) -> tuple[Array, float]:
        """Change of the solution with s in the plane normal to the response curve."""
        ahead = self.continuation(peak.share + DIFFERENCE).balance
        return rate_of_change(self.continuation(peak.share).balance, ahead, DIFFERENCE, peak.point)

    def _peak(self, share: float, point: SolutionPoint, towards: tuple[float, float]) -> PeakPoint | None:
        """The peak at a solution with the slopes of g and the tangent on the side of `towards`."""
        options = self.family.problem.options
        amplitude = output_amplitude(_with_forces(point), options.output, options.measure)
        bare = PeakPoint(share, point, amplitude, 0.0, (0.0, 0.0), towards)
        base = _Base(self, share, point, self._rate(bare))
        ahead, behind, above = (
            base.at(*place) for place in ((DIFFERENCE, 0.0), (-DIFFERENCE, 0.0), (0.0, DIFFERENCE))
        )
        below, here, weights = base.at(0.0, -DIFFERENCE), base.at(0.0, 0.0), (0.0, 0.5, -0.5)
        if below is None:  # the lowest value that the parameter can have: one-sided, of second order
            below, weights = base.at(0.0, 2.0 * DIFFERENCE), (-1.5, 2.0, -0.5)
        if ahead is None or behind is None or above is None or below is None or here is None:
            return None

        def over_share(*values: float) -> float:
            return float(np.dot(weights, values)) / DIFFERENCE

        slopes = (ahead.value - behind.value) / (2.0 * DIFFERENCE), over_share(here.value, above.value, below.value)
        # the amplitude is stationary along the response curve
        rate = over_share(here.amplitude, above.amplitude, below.amplitude)
        size = float(np.hypot(*slopes))
        if size == 0.0:
            return None
        tangent = -slopes[1] / size, slopes[0] / size
        if tangent[0] * towards[0] + tangent[1] * towards[1] < 0.0:
            tangent = -tangent[0], -tangent[1]
        return replace(bare, rate=rate, slopes=slopes, tangent=tangent)


@dataclass(frozen=True)
class _Base:
    """Coordinates (alpha, beta) of the surface around a solution."""

    follower: PeakContinuation
    share: float
    point: SolutionPoint
    rate: tuple[Array, float] | None

    def at(self, alpha: float, beta: float) -> Stationary | None:
        """The solution at a place of the surface."""
        point = self.point
        if self.rate is not None:
            x, omega = point.unknown + beta * self.rate[0], point.omega + beta * self.rate[1]
            point = replace(point, unknown=x, parameter=omega)
        try:
            continuation = self.follower.continuation(self.share + beta)
        except (ContactError, OptionsError):  # beyond what is allowed: friction or preload below 0
            return None
        return _solved(continuation, point, alpha)


def _with_forces(point: SolutionPoint) -> SolutionPoint:
    """The point with the contact forces and their Jacobian."""
    return replace(point, contact=point.balance.element.evaluate(point.displacement))
