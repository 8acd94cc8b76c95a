"""Location of special points between two points of a curve: zeros of a test function, changes of stability."""

from collections.abc import Callable
from functools import partial

from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.continuation.zero_bracket import ZeroBracket
from nonlinear.stability.floquet import NEUTRAL

MAX_ITERATIONS = 60
MAX_ARC_BRACKET = 1e-3  # arc length of a bracket that is narrow enough in frequency
SMALLEST_ARC_BRACKET = 1e-13
HALVINGS = 12  # of the arc length between two points, to the shortest step from one side of a bracket

TestFunction = Callable[[SolutionPoint], float]


def locate_zero(
    continuation: Continuation,
    before: SolutionPoint,
    after: SolutionPoint,
    test_function: TestFunction,
    integral: TestFunction | None = None,
) -> SolutionPoint | None:
    """The point between two neighbours at which a test function changes its sign; None if it does not.

    The arc length beyond `before` is interpolated between points on both sides of the zero, with a corrector solve in
    each iteration, until the frequency is known to the peak tolerance. Where the sign changes with the number of
    harmonics, it is the first point, solved with those of the second.
    """
    if not test_function(before) * test_function(after) < 0.0:
        return None
    common = _with_equal_harmonics(continuation, before, after, continuation.recorder.record)
    if common is None:
        return None
    before, continuation = common, continuation.with_balance(common.balance)
    values = test_function(before), test_function(after)
    if not (after.arc > before.arc and values[0] * values[1] < 0.0):
        return continuation.recorder.with_exponents(before)
    rise = None if integral is None else integral(after) - integral(before)
    bracket = ZeroBracket((0.0, values[0]), (after.arc - before.arc, values[1]))
    sides, last = (before, after), float("inf")
    arc = bracket.next_place(0.0) if rise is None else bracket.zero_of_derivative(rise)
    for _ in range(MAX_ITERATIONS):
        point = continuation.solver.step(before, arc, refactorise=True)
        if point is None:
            break
        point = continuation.recorder.record(point)
        value = test_function(point)
        beyond = value * values[0] <= 0.0
        bracket = bracket.narrowed(arc, value, beyond)
        sides, values = ((sides[0], point), (values[0], value)) if beyond else ((point, sides[1]), (value, values[1]))
        change, last = abs(point.omega - last), point.omega
        tolerance, width = continuation.options.peak_tolerance * point.omega, abs(sides[1].omega - sides[0].omega)
        if width <= tolerance and change <= tolerance and bracket.width < MAX_ARC_BRACKET:
            break
        if value == 0.0 or bracket.width < SMALLEST_ARC_BRACKET:
            break
        share = min(tolerance / width, 1.0) if width > 0.0 else 1.0
        arc = bracket.next_place(0.5 * min(share * bracket.width, MAX_ARC_BRACKET))
    best = sides[0] if abs(values[0]) < abs(values[1]) else sides[1]
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

    It is `after` where the two are one point with different numbers of harmonics.
    `rate` passes zero there: by how much the exponent that crosses the imaginary axis exceeds what counts as growth.
    It is interpolated as in `locate_zero`. A point where it is zero but for its error will do.
    `record` adds the exponents to a point: by default those of the wave.
    """
    record = record or partial(continuation.recorder.record, exponents=True)
    common = _with_equal_harmonics(continuation, before, after, record)
    if common is None:
        return None
    before, continuation = common, continuation.with_balance(common.balance)
    if not after.arc > before.arc:
        return after
    best, bracket = after, ZeroBracket((0.0, rate(before)), (after.arc - before.arc, rate(after)))
    resolution = bracket.width / 2**HALVINGS
    for _ in range(2 * HALVINGS):
        arc = bracket.next_place(resolution)
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
