"""Location of special points between two points of a curve: zeros of a test function, changes of stability.

References
----------
M. Dowell, P. Jarratt, "A modified regula falsi method for computing the root of an equation", BIT 11, 1971,
pp. 168-174. (Illinois variant)
"""

from collections.abc import Callable

from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.solution_point import SolutionPoint

MAX_ITERATIONS = 60
MAX_ARC_BRACKET = 1e-3  # arc length of a bracket that is narrow enough in frequency
SMALLEST_ARC_BRACKET = 1e-13
HALVINGS = 12

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
    common = _with_equal_harmonics(continuation, before, after)
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
        point = continuation.recorder.record(point, exponents=False)
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
    """The first point, to the resolution of 12 bisections, at which `changed` is true, as it is at `after`.

    `rate`, the real part of the exponent that crosses the imaginary axis, is interpolated, safeguarded by bisection.
    `record` adds the exponents to a point: by default those of the wave.
    """
    record = record or continuation.recorder.record
    common = _with_equal_harmonics(continuation, before, after, record)
    if common is None:
        return None
    before, continuation = common, continuation.with_balance(common.balance)
    left, right, best = 0.0, after.arc - before.arc, after
    left_rate, right_rate = rate(before), rate(after)
    resolution = right / 2**HALVINGS
    for count in range(2 * HALVINGS):
        arc = 0.5 * (left + right)
        if left_rate * right_rate < 0.0 and count % 3 < 2:
            zero = (left * right_rate - right * left_rate) / (right_rate - left_rate)
            # a little into the longer part: if the interpolation is good, all of that part is cut off
            arc = zero + (resolution if zero < arc else -resolution)
        point = continuation.solver.step(before, arc)
        if point is None:
            break
        point = record(point)
        if changed(point):
            right, right_rate, best = arc, rate(point), point
        else:
            left, left_rate = arc, rate(point)
        if right - left <= 2.0 * resolution:
            break
    return best


def _with_equal_harmonics(
    continuation: Continuation,
    before: SolutionPoint,
    after: SolutionPoint,
    record: Callable[[SolutionPoint], SolutionPoint] | None = None,
) -> SolutionPoint | None:
    """The first point with the harmonics of the second."""
    if before.balance is after.balance:
        return before
    refitted = continuation.with_balance(after.balance).solver.refit(before)
    return None if refitted is None else (record or continuation.recorder.record)(refitted)
