"""Special points located between two points of a curve: peaks, folds and other losses of stability.

Each is the zero of a test function, dA/ds at a peak and d omega/ds at a fold, or the change of a flag.
"""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.response_quantities import output_amplitude
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.continuation.zero_bracket import ZeroBracket
from nonlinear.response_curve import BifurcationKind
from nonlinear.stability.floquet import NEUTRAL, Instability, crossings, growth_limit, with_conjugate

MAX_ITERATIONS = 60
MAX_ARC_BRACKET = 1e-3  # arc length of a bracket that is narrow enough in frequency
SMALLEST_ARC_BRACKET = 1e-13
HALVINGS = 12  # of the arc length between two points, to the shortest step from one side of a bracket

TestFunction = Callable[[SolutionPoint], float]
SAME_EXPONENT = 0.02  # distance of two values of one exponent, in units of omega
KINDS = {
    Instability.REAL: BifurcationKind.BRANCH_POINT,
    Instability.COMPLEX: BifurcationKind.NEIMARK_SACKER,
    Instability.PERIOD_DOUBLING: BifurcationKind.PERIOD_DOUBLING,
}


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


def locate_peak(continuation: Continuation, before: SolutionPoint, after: SolutionPoint) -> SolutionPoint | None:
    """The maximum of the amplitude between two neighbouring points; None if there is none."""
    if not before.dA_ds > 0.0 > after.dA_ds:
        return None
    output = continuation.options.output
    return locate_zero(
        continuation, before, after, lambda point: point.dA_ds, lambda point: output_amplitude(point, output)
    )


def locate_bifurcations(
    continuation: Continuation, before: SolutionPoint, after: SolutionPoint
) -> Iterator[tuple[BifurcationKind, SolutionPoint]]:
    """Bifurcations between two neighbouring points, each as its kind and the point there.

    Where the motion is unstable on both sides, and no conclusion rests on the place, that is the second point; a
    complex pair that crosses there is known to within a few points (`with_wave_exponents`).
    """
    has_fold = before.tangent[1] * after.tangent[1] < 0.0
    if has_fold:
        fold = locate_zero(continuation, before, after, lambda point: point.tangent[1], lambda point: point.omega)
        if fold is not None:
            yield BifurcationKind.FOLD, fold
            if before.exponents is not None and fold.exponents is not None:
                # between a period doubling and the fold the motion is stable
                for one, other in ((before, fold), (fold, after)):
                    yield from _exponents_crossing(continuation, one, other, at_fold=True)
                return
    yield from _exponents_crossing(continuation, before, after, at_fold=has_fold)


def _exponents_crossing(
    continuation: Continuation, before: SolutionPoint, after: SolutionPoint, *, at_fold: bool
) -> Iterator[tuple[BifurcationKind, SolutionPoint]]:
    """What the exponents of two neighbouring points tell of; `at_fold`: the real one that passes zero is its own."""
    if before.exponents is None or after.exponents is None or before.undecided or after.undecided:
        return
    unstable, rank = before.unstable, min(before.unstable, after.unstable)
    stays_unstable = not before.stable_wave and not after.stable_wave
    for kind in _crossings(before, after):
        if kind is BifurcationKind.BRANCH_POINT and at_fold:
            continue
        if stays_unstable:
            yield kind, after
            continue
        found = _located_by_one(continuation, before, after, rank)
        if found is None or found.unstable == unstable:
            found = locate_change(
                continuation,
                before,
                after,
                lambda point: point.unstable != unstable,
                lambda point: _excess_rate(point, rank),
            )
        if found is not None:
            yield kind, found


def _located_by_one(
    continuation: Continuation, before: SolutionPoint, after: SolutionPoint, rank: int
) -> SolutionPoint | None:
    """The change as `locate_change` finds it, with the one exponent that crosses; where that is lost with all.

    None without exponents that grow.
    """
    stability = continuation.stability
    growing = before if before.unstable > after.unstable else after
    if stability is None or growing.exponents is None or growing.exponents.size <= rank:
        return None
    start, followed = complex(growing.exponents[rank]), list[SolutionPoint]()

    def record(point: SolutionPoint) -> SolutionPoint:
        found = stability.follow_wave(point, start)
        if found is None:
            return continuation.recorder.record(point, exponents=True)
        followed.append(continuation.recorder.record(point).changed(exponents=np.array([found])))
        return followed[-1]

    def rate(point: SolutionPoint) -> float:
        return _excess_rate(point, 0 if any(point is one for one in followed) else rank)

    found = locate_change(
        continuation, before, after, lambda point: (rate(point) > 0.0) == (growing is after), rate, record
    )
    if found is None or not any(found is one for one in followed):
        return found
    assert found.exponents is not None
    return _with_exponent(continuation.recorder.with_exponents(found.changed(exponents=None)), found.exponents[0])


def _with_exponent(point: SolutionPoint, exact: complex) -> SolutionPoint:
    """The point with an exponent (1/s) that was followed, in place of the nearest one: others may be approximate."""
    exponents = np.zeros(0, dtype=complex) if point.exponents is None else point.exponents
    own = with_conjugate(exact)
    for value in own:
        distance = np.abs(exponents - value)
        if distance.size and distance.min() < SAME_EXPONENT * point.omega:
            exponents = np.delete(exponents, np.argmin(distance))
    every = np.append(exponents, own)
    return point.changed(exponents=every[np.argsort(-every.real)])


def _excess_rate(point: SolutionPoint, rank: int) -> float:
    """By how much the exponent of this rank, 0 being the least stable, exceeds what counts as growth, 1/s.

    NaN if there are fewer exponents.
    """
    exponents = point.exponents
    if exponents is None or exponents.size <= rank:
        return float("nan")
    return float(exponents[rank].real - growth_limit(exponents[rank], point.omega))


def _crossings(before: SolutionPoint, after: SolutionPoint) -> list[BifurcationKind]:
    """Kinds of bifurcation that the exponents of two neighbouring points tell of."""
    assert before.exponents is not None
    assert after.exponents is not None
    return [KINDS[item] for item in crossings(before.exponents, after.exponents, after.omega)]
