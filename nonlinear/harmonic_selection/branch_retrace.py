"""The way to a peak retraced with more harmonics: does the branch still lead to it?

With more harmonics a high response may detach from the curve: the curve turns below it, and the peak lies on an
isolated branch. The peak alone, followed to more harmonics, does not tell.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from nonlinear.continuation.acceptance import passes_through
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.solution_point import SolutionPoint, Tangent
from nonlinear.harmonic_selection.peak_following import PeakFollower
from nonlinear.harmonic_selection.way_sampling import WaySampling
from nonlinear.harmonic_selection.work_limit import WorkLimit

SAME_FREQUENCY = 1e-9  # relative difference of two frequencies that count as one

Amplitude = Callable[[SolutionPoint], float]


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
            point = replace(point, unknown=point.unknown + shift[0], omega=point.omega + shift[1])
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
    amplitude: Amplitude,
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
    left_range = before is not start and is_limit(before.omega, wider.options.omega_range)
    return Retrace(False if left_range else None, *top), None


def is_limit(omega: float, omega_range: tuple[float, float]) -> bool:
    """Whether a frequency is an end of the range, rad/s."""
    return any(abs(omega - limit) <= SAME_FREQUENCY * limit for limit in omega_range)
