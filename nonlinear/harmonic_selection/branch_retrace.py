"""The way to a peak retraced with more harmonics: does the branch still lead to it?

With more harmonics a high response may detach from the curve: the curve turns below it, and the peak lies on an
isolated branch. The peak alone, followed to more harmonics, does not tell.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.events import passes_through
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_selection.work_limit import WorkLimit

SAME_FREQUENCY = 1e-9  # relative difference of two frequencies that count as one

Amplitude = Callable[[SolutionPoint], float]


@dataclass(frozen=True)
class WayToPeak:
    """The shorter side of a peak, from a linear segment or an end of the curve to the peak.

    Attributes
    ----------
    start : SolutionPoint
        First point, its tangent towards the peak.
    omega_range : tuple of float
        Lowest and highest frequency of the peak and of the ends of both its sides, rad/s.
    indices : range
        Indices of the points on both sides.
    has_folds : bool
        Whether there are folds on either side.
    """

    start: SolutionPoint
    omega_range: tuple[float, float]
    indices: range
    has_folds: bool


@dataclass(frozen=True)
class Retrace:
    """What the branch with more harmonics does on the way to a peak.

    Attributes
    ----------
    reached : bool or None
        Whether it passes through the peak; None where the retrace ends before that is known.
    amplitude : float
        Its highest amplitude on the way, m.
    omega : float
        Frequency there, rad/s.
    """

    reached: bool | None
    amplitude: float
    omega: float


def way_to_peak(continuation: Continuation, points: Sequence[SolutionPoint], index: int) -> WayToPeak:
    """The shorter side of the peak with this index.

    On a linear segment all numbers of harmonics give the same response: the branch is the same there.
    """
    left = next((place for place in range(index - 1, 0, -1) if continuation.is_linear(points[place])), 0)
    last = len(points) - 1
    right = next((place for place in range(index + 1, last) if continuation.is_linear(points[place])), last)
    start = points[left] if index - left <= right - index else points[right].reversed()
    frequencies = [points[place].omega for place in (left, index, right)]
    indices = range(left, right + 1)
    has_folds = len({points[place].jacobian_sign for place in indices}) > 1
    return WayToPeak(start, (min(frequencies), max(frequencies)), indices, has_folds)


def retrace(
    wider: Continuation, way: WayToPeak, target: SolutionPoint | None, amplitude: Amplitude, work: WorkLimit
) -> Retrace:
    """Follow the branch with the harmonics of `wider` along the way until it passes through the peak `target`.

    It passes below the peak where it leaves the frequencies of the way on the other side on a linear segment, or the
    frequency range. Without a target it is followed that far.
    """
    start = wider.solver.refit(way.start)
    if start is None:
        return Retrace(None, 0.0, way.start.omega)
    targets = () if target is None else (target, target.reversed())
    rising = start.tangent[1] > 0.0
    before, top = start, (amplitude(start), start.omega)
    for point in work.branch(wider, start):
        height = amplitude(point)
        top = max(top, (height, point.omega))
        if any(passes_through(wider.solver, before, point, each) for each in targets):
            return Retrace(True, *top)
        beyond = point.omega > way.omega_range[1] if rising else point.omega < way.omega_range[0]
        if beyond and point.linear is not None:
            return Retrace(False, *top)
        before = point
    left_range = before is not start and is_limit(before.omega, wider.options.omega_range)
    return Retrace(False if left_range else None, *top)


def is_limit(omega: float, omega_range: tuple[float, float]) -> bool:
    """Whether a frequency is an end of the range, rad/s."""
    return any(abs(omega - limit) <= SAME_FREQUENCY * limit for limit in omega_range)
