"""Places on a curve where a quantity is zero: peaks of the amplitude, folds, and changes of stability."""

from collections.abc import Callable

from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.solution_point import SolutionPoint

MAX_TRIALS = 60
HALVINGS = 12

Quantity = Callable[[SolutionPoint], float]


def locate_zero(
    continuation: Continuation, before: SolutionPoint, after: SolutionPoint, quantity: Quantity
) -> SolutionPoint | None:
    """The point between two neighbours at which `quantity` changes sign; None if it does not.

    The arc length beyond `before` is narrowed by regula falsi (Illinois), with a corrector solve at each trial, until
    the bracket is shorter than the peak tolerance asks for.
    """
    options = continuation.options
    left, right = 0.0, after.arc - before.arc
    first, last = quantity(before), quantity(after)
    if not first * last < 0.0:
        return None
    common = _with_equal_harmonics(continuation, before, after)
    if common is None:
        return None
    before, continuation = common, continuation.of(common.balance)
    best, side = (before if abs(first) < abs(last) else after), 0
    frequencies = (before.omega, after.omega)
    for _ in range(MAX_TRIALS):
        trial = (left * last - right * first) / (last - first)
        if not left < trial < right:
            trial = 0.5 * (left + right)
        point = continuation.correct(before, trial, sharp=True)
        if point is None:
            break
        point = continuation.recorded(point, exponents=False)
        value = quantity(point)
        moved, best = abs(point.omega - best.omega), point
        if value * first > 0.0:
            left, first = trial, value
            last, side = (last / 2.0 if side == 1 else last), 1
            frequencies = (point.omega, frequencies[1])
        else:
            right, last = trial, value
            first, side = (first / 2.0 if side == -1 else first), -1
            frequencies = (frequencies[0], point.omega)
        allowed = options.peak_tolerance * point.omega
        if abs(frequencies[1] - frequencies[0]) <= allowed and moved <= allowed and right - left < 1e-3:
            break
        if value == 0.0 or right - left < 1e-13:
            break
    if best is before or best is after:
        return best
    return continuation.with_exponents(best)


def locate_change(
    continuation: Continuation, before: SolutionPoint, after: SolutionPoint, changed: Callable[[SolutionPoint], bool]
) -> SolutionPoint | None:
    """A point at which `changed` is true, as at `after`, hardly beyond one where it is not, as at `before`.

    The exponent that passes the imaginary axis tells where to look; bisection guards that.
    """
    common = _with_equal_harmonics(continuation, before, after)
    if common is None:
        return None
    before, continuation = common, continuation.of(common.balance)
    rank = min(before.unstable, after.unstable)
    left, right, best = 0.0, after.arc - before.arc, after
    first, last = _growth(before, rank), _growth(after, rank)
    wanted = right / 2**HALVINGS
    for count in range(2 * HALVINGS):
        trial = 0.5 * (left + right)
        if first * last < 0.0 and count % 3 < 2:
            guess = (left * last - right * first) / (last - first)
            # a little into the longer part: if the guess is good, all of that is cut off
            trial = guess + (wanted if guess < trial else -wanted)
        point = continuation.correct(before, trial)
        if point is None:
            break
        point = continuation.recorded(point)
        if changed(point):
            right, last, best = trial, _growth(point, rank), point
        else:
            left, first = trial, _growth(point, rank)
        if right - left <= 2.0 * wanted:
            break
    return best


def _growth(point: SolutionPoint, rank: int) -> float:
    """Real part (1/s) of the exponent of this rank, the least stable being 0; NaN if there are not so many."""
    exponents = point.exponents
    return float("nan") if exponents is None or exponents.size <= rank else float(exponents[rank].real)


def _with_equal_harmonics(
    continuation: Continuation, before: SolutionPoint, after: SolutionPoint
) -> SolutionPoint | None:
    """The first point with the harmonics of the second."""
    if before.balance is after.balance:
        return before
    refitted = continuation.of(after.balance).refit(before)
    return None if refitted is None else continuation.recorded(refitted)
