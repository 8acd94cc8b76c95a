"""Location of special points between two points of a curve: zeros of a test function, changes of stability.

References
----------
M. Dowell, P. Jarratt, "A modified regula falsi method for computing the root of an equation", BIT 11, 1971,
pp. 168-174. (Illinois variant)
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.stability.floquet import NEUTRAL

MAX_ITERATIONS = 60
MAX_ARC_BRACKET = 1e-3  # arc length of a bracket that is narrow enough in frequency
SMALLEST_ARC_BRACKET = 1e-13
HALVINGS = 12  # of the arc length between two points, to its part that a step goes beyond the zero expected

TestFunction = Callable[[SolutionPoint], float]


def locate_zero(
    continuation: Continuation, before: SolutionPoint, after: SolutionPoint, test_function: TestFunction
) -> SolutionPoint | None:
    """The point between two neighbours at which a test function changes its sign; None if it does not.

    The arc length beyond `before` is bracketed by regula falsi (Illinois variant), with a corrector solve in each
    iteration, until the frequency is known to the peak tolerance.
    """
    options = continuation.options
    left, right = 0.0, after.arc - before.arc
    left_value, right_value = test_function(before), test_function(after)
    if not left_value * right_value < 0.0:
        return None
    common = _with_equal_harmonics(continuation, before, after, continuation.recorder.record)
    if common is None:
        return None
    before, continuation = common, continuation.with_balance(common.balance)
    best, side = (before if abs(left_value) < abs(right_value) else after), 0
    frequencies = (before.omega, after.omega)
    for _ in range(MAX_ITERATIONS):
        arc = (left * right_value - right * left_value) / (right_value - left_value)
        if not left < arc < right:
            arc = 0.5 * (left + right)
        point = continuation.solver.step(before, arc, refactorise=True)
        if point is None:
            break
        point = continuation.recorder.record(point)
        value = test_function(point)
        change, best = abs(point.omega - best.omega), point
        if value * left_value > 0.0:
            left, left_value = arc, value
            right_value, side = (right_value / 2.0 if side == 1 else right_value), 1
            frequencies = (point.omega, frequencies[1])
        else:
            right, right_value = arc, value
            left_value, side = (left_value / 2.0 if side == -1 else left_value), -1
            frequencies = (frequencies[0], point.omega)
        tolerance = options.peak_tolerance * point.omega
        if (
            abs(frequencies[1] - frequencies[0]) <= tolerance
            and change <= tolerance
            and right - left < MAX_ARC_BRACKET
        ):
            break
        if value == 0.0 or right - left < SMALLEST_ARC_BRACKET:
            break
    if best is before or best is after:
        return best
    return continuation.recorder.with_exponents(best)


def locate_change(
    continuation: Continuation,
    before: SolutionPoint,
    after: SolutionPoint,
    changed: Callable[[SolutionPoint], bool],
    rate: TestFunction,
    record: Callable[[SolutionPoint], SolutionPoint] | None = None,
) -> SolutionPoint | None:
    """The first point, to the resolution of 11 bisections, at which `changed` is true, as it is at `after`.

    `rate` passes zero there: by how much the exponent that crosses the imaginary axis exceeds what counts as growth.
    It is interpolated, safeguarded by bisection. A point where it is zero but for its error will do.
    `record` adds the exponents to a point: by default those of the wave.
    """
    record = record or partial(continuation.recorder.record, exponents=True)
    common = _with_equal_harmonics(continuation, before, after, record)
    if common is None:
        return None
    before, continuation = common, continuation.with_balance(common.balance)
    best, bracket = after, _Bracket((0.0, rate(before)), (after.arc - before.arc, rate(after)))
    resolution = bracket.width / 2**HALVINGS
    for _ in range(2 * HALVINGS):
        arc = bracket.next_arc(resolution)
        point = continuation.solver.step(before, arc)
        if point is None:
            break
        point = record(point)
        value, has_changed = rate(point), changed(point)
        bracket = bracket.narrowed(arc, value, has_changed)
        if has_changed:
            best = point
        if bracket.width <= 2.0 * resolution or (has_changed and abs(value) <= NEUTRAL * point.omega):
            break
    return best


class _Bracket(NamedTuple):
    """The arc length and the rate on both sides of a change, and those replaced last."""

    left: tuple[float, float]
    right: tuple[float, float]
    third: tuple[float, float] = (float("nan"), float("nan"))
    slow: int = 0

    @property
    def width(self) -> float:
        """Arc length between the two sides."""
        return self.right[0] - self.left[0]

    def narrowed(self, arc: float, value: float, has_changed: bool) -> "_Bracket":
        """The bracket with one of its sides at `arc`."""
        left, right = (self.left, (arc, value)) if has_changed else ((arc, value), self.right)
        slow = self.slow + 1 if right[0] - left[0] > 0.5 * self.width else 0
        return _Bracket(left, right, self.right if has_changed else self.left, slow)

    def next_arc(self, resolution: float) -> float:
        """Where to look next: a little beyond the zero of the rate, in the middle where that does not help."""
        (left, left_rate), (right, right_rate) = self.left, self.right
        middle = 0.5 * (left + right)
        if not left_rate * right_rate < 0.0 or self.slow >= 2:
            return middle
        zero = (left * right_rate - right * left_rate) / (right_rate - left_rate)
        curved = self._zero_of_parabola()
        # a little into the longer part: if the interpolation is good, all of that part is cut off
        zero = curved if left < curved < right else zero
        beyond = zero + (resolution if zero < middle else -resolution)
        return beyond

    def _zero_of_parabola(self) -> float:
        """Zero of the arc length as a parabola of the rate through three points; NaN where it may not be monotonic.

        The condition is that of T. R. Chandrupatla, Advances in Engineering Software 28, 1997, pp. 145-149, but for
        the order of the ends: first comes the one whose rate is farther from the third, which took fewest steps on
        the curve tried. Where the parabola misses the zero, the bracket still holds it.
        """
        (a, rate_a), (b, rate_b), (c, rate_c) = self.left, self.right, self.third
        if not (rate_c - rate_a) * (rate_c - rate_b) > 0.0:
            return float("nan")
        if abs(rate_c - rate_a) < abs(rate_c - rate_b):
            (a, rate_a), (b, rate_b) = (b, rate_b), (a, rate_a)
        share, drop = (a - b) / (c - b), (rate_a - rate_b) / (rate_c - rate_b)
        if not (drop**2 < share and (1.0 - drop) ** 2 < 1.0 - share):
            return float("nan")
        first = rate_a / (rate_b - rate_a) * rate_c / (rate_b - rate_c)
        return a + (b - a) * first + (c - a) * rate_a / (rate_c - rate_a) * rate_b / (rate_c - rate_b)


def _with_equal_harmonics(
    continuation: Continuation,
    before: SolutionPoint,
    after: SolutionPoint,
    record: Callable[[SolutionPoint], SolutionPoint],
) -> SolutionPoint | None:
    """The first point with the harmonics of the second."""
    if before.balance is after.balance:
        return before
    refitted = continuation.with_balance(after.balance).solver.refit(before)
    return None if refitted is None else record(refitted)
