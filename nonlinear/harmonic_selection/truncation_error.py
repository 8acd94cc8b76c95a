"""What the harmonics that were left out would change: a solved point solved again with more of them."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice, pairwise

import numpy as np

from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.response_quantities import amplitude_slope, largest_amplitude, output_harmonics
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.balance_family import BalanceFamily, resized
from nonlinear.harmonic_balance.initial_solution import solve_at

SAFETY = 1.25
LOOKS = 6  # places along a curve, beside its peaks, where the adaptive choice of harmonics looks
AWAY = (1, 2, 4, 8, 16, 32, 64)  # steps down from a lost peak, on each side, after which the curve is sought again
MOST_ITERATIONS = 20
FIRST_STEP = 0.05  # arc length of the first step up to a peak that moved
MOST_STEPS = 10
MOST_STEPS_BACK = 30  # the same towards one that was lost
WORTH_A_WALK = 0.02  # part of the change of the height that a walk up to the peak may add unseen
NOTHING = 1e-12  # relative change of a response that is linear


def wider_harmonics(n_harmonics: int) -> int:
    """Number of harmonics that H is judged by: 2H + 3, and 8 more where that would be costly."""
    return min(2 * n_harmonics + 3, n_harmonics + 8)


@dataclass(frozen=True)
class Truncation:
    """Estimates the error of the harmonics kept at the points of a curve."""

    continuation: Continuation
    family: BalanceFamily

    def at_peak(self, points: list[SolutionPoint], peak_indices: list[int]) -> float:
        """Estimated relative error of the curve's highest amplitude; NaN without points, inf where it gets lost.

        The peak is followed to H + 2 harmonics, to `wider_harmonics` of H, and to that of the latter. The estimate is
        the sum of the changes from each to the next, relative to the amplitude with more harmonics: amplitudes that
        go up and down are farther from their limit than the last of them tells. The last change counts twice, as if
        each of those that follow were half of the one before, and the whole has the safety factor that Roache (1994)
        gives to solutions on three grids. Where the peak is lost, the highest amplitude with more harmonics that is
        reached from the curve on both sides of it takes its place.
        """
        if not points:
            return float("nan")
        index = max((*peak_indices, 0, len(points) - 1), key=lambda place: self._height(points[place]))
        height = self._height(points[index])
        if height == 0.0:
            return 0.0
        wider = list(self._followed(points, index, index in peak_indices))
        changes = [abs(before / after - 1.0) for before, after in pairwise((height, *wider))]
        return SAFETY * (sum(changes) + changes[-1]) if changes else float("inf")

    def along(self, points: list[SolutionPoint], peak_indices: list[int]) -> float:
        """Largest change of the amplitude at the peaks and at places along the curve, relative to the highest."""
        if not points:
            return float("nan")
        heights = [self._height(point) for point in points]
        if max(heights) == 0.0:
            return 0.0
        spread = np.unique(np.linspace(0, len(points) - 1, LOOKS).astype(int)).tolist()
        looked_at = sorted({*peak_indices, *spread, int(np.argmax(heights))})
        changes = [abs(self._widened_height(points[index]) - heights[index]) for index in looked_at]
        return max(changes) / max(heights)

    def _height(self, point: SolutionPoint) -> float:
        return largest_amplitude(output_harmonics(point, self.continuation.options.output)).value

    def _with(self, n_harmonics: int) -> Continuation:
        return replace(self.continuation.of(self.family.balance(n_harmonics)), adapt=None, stability=None)

    def _widened_height(self, point: SolutionPoint) -> float:
        """Amplitude with more harmonics, in the plane normal to the curve through the point; inf if not found."""
        found = self._with(wider_harmonics(point.balance.n_harmonics)).refit(point)
        return float("inf") if found is None else self._height(found)

    def _followed(self, points: list[SolutionPoint], index: int, is_peak: bool) -> Iterator[float]:
        """Heights of the point with more and more harmonics, without those with which it is not found.

        A peak may move; the end of a range stays at its frequency. The last and costly number only where the others
        found something left out.
        """
        point = points[index]
        height = self._height(point)
        n_harmonics = point.balance.n_harmonics
        once = wider_harmonics(n_harmonics)
        left_out = False
        for more in (n_harmonics + 2, once, wider_harmonics(once)):
            if more > once and not left_out:
                return
            here = self._with(more)
            found = here.refit(point) if is_peak else _at_frequency(here, point)
            if found is None:
                reached = self._from_both_sides(here, point) if is_peak else None
            else:
                reached = self._top(here, found, height) if is_peak else (found, self._height(found))
            if reached is not None:
                point, wider = reached
                left_out = left_out or abs(wider - height) > NOTHING * height
                yield wider

    def _from_both_sides(self, here: Continuation, lost: SolutionPoint) -> tuple[SolutionPoint, float] | None:
        """The highest amplitude that the curve with more harmonics reaches from both sides of a lost peak."""
        narrow = self._with(lost.balance.n_harmonics)
        peak = narrow.refit(lost)
        reached: list[SolutionPoint] = []
        for start in () if peak is None else (peak, _turned(peak)):
            down = islice(narrow.trace(replace(start, step=FIRST_STEP)), AWAY[-1] + 1)
            refits = (here.refit(point) for count, point in enumerate(down) if count in AWAY)
            found = next((point for point in refits if point is not None), None)
            if found is not None:
                reached += islice(here.trace(replace(_turned(found), step=FIRST_STEP)), MOST_STEPS_BACK)
        top = max(reached, key=self._height, default=None)
        return None if top is None else (top, self._height(top))

    def _top(self, here: Continuation, start: SolutionPoint, narrow: float) -> tuple[SolutionPoint, float]:
        """The peak that `start` stands beside, and its height; the highest point met where none is reached.

        Without a walk if what that adds is small beside the change from the height with fewer harmonics.
        """
        output = here.options.output
        height, slope = self._height(start), amplitude_slope(start, output)
        if slope * slope <= WORTH_A_WALK * height * abs(height - narrow):
            return start, height
        if slope < 0.0:
            start = _turned(start)
        before: SolutionPoint | None = None
        for point in islice(here.trace(replace(start, step=FIRST_STEP)), MOST_STEPS):
            if before is not None and point.amplitude_slope <= 0.0:
                return before, _highest_between(before, point, self._height(before), self._height(point))
            before = point
        last = before or start
        return last, self._height(last)


def _turned(point: SolutionPoint) -> SolutionPoint:
    """The point as the beginning of a trace the other way."""
    return replace(point, tangent=(-point.tangent[0], -point.tangent[1]), orientation=-point.orientation)


def _at_frequency(here: Continuation, point: SolutionPoint) -> SolutionPoint | None:
    """The solution at the frequency of a point of another number of harmonics, by damped Newton steps from there."""
    start = resized(point, here.balance)
    solved = solve_at(here.balance, start.omega, start.unknown, here.options, MOST_ITERATIONS)
    if not solved.converged:
        return None
    return here.point(solved.solution, start.omega, start.tangent, solved.iterations, start.arc, start.step)


def _highest_between(before: SolutionPoint, after: SolutionPoint, low: float, high: float) -> float:
    """Largest value of the cubic with the heights and slopes of the amplitude at two points."""
    length = after.arc - before.arc
    s = np.linspace(0.0, 1.0, 129)
    rising, falling = length * before.amplitude_slope, length * after.amplitude_slope
    cubic = (1.0 + 2.0 * s) * (1.0 - s) ** 2 * low + s**2 * (3.0 - 2.0 * s) * high
    cubic += s * (1.0 - s) ** 2 * rising - s**2 * (1.0 - s) * falling
    return float(cubic.max())
