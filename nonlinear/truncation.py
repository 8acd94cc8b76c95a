"""What the harmonics that were left out would change: a solved point solved again with more of them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice, pairwise

import numpy as np

from nonlinear.continuation import Continuation
from nonlinear.curve_point import CurvePoint
from nonlinear.family import BalanceFamily, resized
from nonlinear.quantities import amplitude_slope, largest_amplitude, output_harmonics
from nonlinear.start import solve_at
from nonlinear.tracing import trace_range

LOOKS = 6  # places along a curve, beside its peaks, where the adaptive choice of harmonics looks
NEIGHBOURS = 2  # points on each side from which a point is sought too if it is lost
MOST_ITERATIONS = 20
FIRST_STEP = 0.05  # arc length of the first step up to a peak that moved
MOST_STEPS = 10
WORTH_A_WALK = 0.02  # part of the change of the height that a walk up to the peak may add unseen
LONGER = 4  # times as many points as the curve has: with more, one traced again is given up
NOTHING = 1e-12  # relative change of a response that is linear


def wider_harmonics(n_harmonics: int) -> int:
    """Number of harmonics that H is judged by: 2H + 3, and 8 more where that would be costly."""
    return min(2 * n_harmonics + 3, n_harmonics + 8)


@dataclass(frozen=True)
class Truncation:
    """Estimates the error of the harmonics kept at the points of a curve."""

    continuation: Continuation
    family: BalanceFamily

    def at_peak(self, points: list[CurvePoint], peak_indices: list[int]) -> float:
        """Estimated relative error of the curve's highest amplitude; NaN without points, inf where it gets lost.

        The peak is followed to H + 2 harmonics, to `wider_harmonics` of H, and to that of the latter. The estimate is
        the sum of the changes from each to the next, relative to the amplitude with more harmonics: amplitudes that
        go up and down are farther from their limit than the last of them tells. A peak that is found with none of
        these is compared with the highest of the curve traced again with H + 2.
        """
        if not points:
            return float("nan")
        index = max((*peak_indices, 0, len(points) - 1), key=lambda place: self._height(points[place]))
        height = self._height(points[index])
        if height == 0.0:
            return 0.0
        wider = list(self._followed(points, index, index in peak_indices)) or self._traced_again(points)
        changes = [abs(before / after - 1.0) for before, after in pairwise((height, *wider))]
        return sum(changes) if changes else float("inf")

    def along(self, points: list[CurvePoint], peak_indices: list[int]) -> float:
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

    def _height(self, point: CurvePoint) -> float:
        return largest_amplitude(output_harmonics(point, self.continuation.options.output)).value

    def _with(self, n_harmonics: int) -> Continuation:
        return replace(self.continuation.of(self.family.balance(n_harmonics)), adapt=None, stability=None)

    def _widened_height(self, point: CurvePoint) -> float:
        """Amplitude with more harmonics, in the plane normal to the curve through the point; inf if not found."""
        found = self._with(wider_harmonics(point.balance.n_harmonics)).refit(point)
        return float("inf") if found is None else self._height(found)

    def _followed(self, points: list[CurvePoint], index: int, is_peak: bool) -> Iterator[float]:
        """Heights of the point with more and more harmonics, without those with which it is not found.

        A peak may move; the end of a range stays at its frequency. The last and costly number only where the others
        found something left out, and without a long search.
        """
        point = points[index]
        height = self._height(point)
        n_harmonics = point.balance.n_harmonics
        once = wider_harmonics(n_harmonics)
        beside = [points[place] for place in _beside(index, len(points))]
        left_out = False
        for more in (n_harmonics + 2, once, wider_harmonics(once)):
            if more > once and not left_out:
                return
            here = self._with(more)
            found = here.refit(point) if is_peak else _at_frequency(here, point)
            if found is None and is_peak and more <= once:
                found = _sought(here, point, beside)
            if found is not None:
                point, wider = self._top(here, found, height) if is_peak else (found, self._height(found))
                left_out = left_out or abs(wider - height) > NOTHING * height
                yield wider

    def _traced_again(self, points: list[CurvePoint]) -> list[float]:
        """Height of the highest point of the curve with H + 2; none where that is not complete or far longer."""
        balance = points[0].balance
        if any(point.balance is not balance for point in points):
            return []
        options = replace(self.continuation.options, max_points=LONGER * len(points))
        here = replace(self._with(balance.n_harmonics + 2), options=options)
        again = trace_range(here, points[0].displacement[0])[0]
        return [max(self._height(point) for point in again.points)] if again.outcome.complete else []

    def _top(self, here: Continuation, start: CurvePoint, narrow: float) -> tuple[CurvePoint, float]:
        """The peak that `start` stands beside, and its height; the highest point met where none is reached.

        Without a walk if what that adds is small beside the change from the height with fewer harmonics.
        """
        output = here.options.output
        height, slope = self._height(start), amplitude_slope(start, output)
        if slope * slope <= WORTH_A_WALK * height * abs(height - narrow):
            return start, height
        if slope < 0.0:
            tangent = -start.tangent[0], -start.tangent[1]
            start = replace(start, tangent=tangent, orientation=-start.orientation)
        before: CurvePoint | None = None
        for point in islice(here.trace(replace(start, step=FIRST_STEP)), MOST_STEPS):
            if before is not None and point.amplitude_slope <= 0.0:
                return before, _highest_between(before, point, self._height(before), self._height(point))
            before = point
        last = before or start
        return last, self._height(last)


def _beside(index: int, count: int) -> list[int]:
    """Places next to `index`, the nearest first."""
    places = [index + side * away for away in range(1, NEIGHBOURS + 1) for side in (-1, 1)]
    return [place for place in places if 0 <= place < count]


def _sought(here: Continuation, lost: CurvePoint, beside: Sequence[CurvePoint]) -> CurvePoint | None:
    """A solution near a point that is not found in its plane: in that of one beside it, else at its frequency."""
    for start in beside:
        found = here.refit(start)
        if found is not None:
            return found
    return _at_frequency(here, lost)


def _at_frequency(here: Continuation, point: CurvePoint) -> CurvePoint | None:
    """The solution at the frequency of a point of another number of harmonics, by damped Newton steps from there."""
    start = resized(point, here.balance)
    solved = solve_at(here.balance, start.frequency, start.unknown, here.options, MOST_ITERATIONS)
    if not solved.converged:
        return None
    return here.point(solved.solution, start.frequency, start.tangent, solved.iterations, start.arc, start.step)


def _highest_between(before: CurvePoint, after: CurvePoint, low: float, high: float) -> float:
    """Largest value of the cubic with the heights and slopes of the amplitude at two points."""
    length = after.arc - before.arc
    s = np.linspace(0.0, 1.0, 129)
    rising, falling = length * before.amplitude_slope, length * after.amplitude_slope
    cubic = (1.0 + 2.0 * s) * (1.0 - s) ** 2 * low + s**2 * (3.0 - 2.0 * s) * high
    cubic += s * (1.0 - s) ** 2 * rising - s**2 * (1.0 - s) * falling
    return float(cubic.max())
