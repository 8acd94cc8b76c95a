"""Floquet exponents along a branch: of the wave and of all other nodal diameters, and where one of these grows.

Exponents of the wave: a real one that passes zero changes the sign of det dR/dx, which is known at every point. All
are computed in some points and halfway between them. Where all of them decay, the leading one is interpolated between
these; where the rate halfway is not as interpolated, all are computed in more points. Where some grow at two of these
points, one of them is followed halfway, and the same is done with its rate.

Other nodal diameters: all are looked at in some points. Between two of them the leading exponent is followed to the
middle; where the exponents are not alike, more points are looked at, else the exponent is interpolated. Where the
wave itself is unstable, exponents of other nodal diameters change no flag: there the points looked at suffice.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby, pairwise

import numpy as np

from nonlinear.branches.special_points import KINDS, locate_change
from nonlinear.contact.fourier import ComplexArray
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.point_stability import PointRecorder, PointStability
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.response_curve import BifurcationKind
from nonlinear.stability.floquet import NEUTRAL, grows, instability_of, with_conjugate
from nonlinear.stability.ring_stability import PatternExponent

WAVE_SHARE = 0.5  # of the work that is left, so that peaks and other nodal diameters have some too
WAVE_STRIDE = 8  # points from one whose exponents are computed to the next
DECAY_ERROR = 0.2  # relative error of a rate of decay, halfway between two others, that may be interpolated
GROWTH_ERROR = 0.05  # the same of a rate of growth
SIMILAR_FREQUENCY = 0.05  # difference of Im lambda, in units of omega, of two exponents of one family
STRIDE = 4  # points from one at which all nodal diameters are looked at to the next
GROWING_STRIDE = 16  # the same where perturbations grow at both: one exponent that grows is followed between them
UNSTABLE_STRIDE = 64  # the same in long stretches where the wave itself is unstable
LOOKS = 8  # at a shorter stretch
AMPLIFIED = 0.98  # share of the least decay without contact; what decays slower is fed by contact forces
SIMILAR_DECAY = 0.2  # relative difference of two rates of decay between which one is interpolated
STEADY_DECAY = 0.02  # the same of rates slower than any without contact
UNSTABLE_WAVE = 1e-3  # growth of the wave, in units of omega, beside which other nodal diameters change no flag
MAX_LOCATIONS = 4  # nodal diameters that may take over from each other where the motion becomes unstable


def with_wave_exponents(
    recorder: PointRecorder, points: list[SolutionPoint], exact: Sequence[int] = ()
) -> list[SolutionPoint]:
    """The points of a branch with the exponents of perturbations that have the symmetry of the wave.

    Where all of them decay, that of the least stable one is interpolated; `exponents` has no others there. Where the
    leading one grows and is followed or interpolated, `exponents` has it, and the others that grow as at a point next
    to it. Points that have an exponent of the ring already, which grows, get none.
    """
    if recorder.stability is None:
        return points
    result, stability, budget = list(points), recorder.stability, recorder.stability.budget
    recorder = replace(recorder, limit=budget.spent + WAVE_SHARE * (budget.most - budget.spent))
    for run, linear in _unmarked_runs(stability, points):
        chosen = {*run} if linear else {*run[::WAVE_STRIDE], run[-1], *beside_state_changes(points, run)}
        looked_at = sorted(chosen | (set(run) & {*exact}))
        for index in highest_first(points, looked_at):
            result[index] = recorder.with_exponents(points[index])
        for first, last in pairwise(looked_at):
            _fill_wave(recorder, result, first, last)
    return result


def highest_first(points: list[SolutionPoint], places: Iterable[int]) -> list[int]:
    """Places of points by their vibration: with little work left the low ones stay undecided."""
    return sorted(places, key=lambda place: -points[place].balance.vibration(points[place].unknown))


def runs_of_points(stability: PointStability, points: list[SolutionPoint]) -> Iterator[tuple[list[int], bool]]:
    """Points in a row whose contacts change their state, or do not: their indices, and whether not."""
    for linear, run in groupby(range(len(points)), lambda index: stability.linear_state(points[index]) is not None):
        yield list(run), linear


def _unmarked_runs(stability: PointStability, points: list[SolutionPoint]) -> Iterator[tuple[list[int], bool]]:
    """The parts of the same without points that have an exponent of the ring already, which grows."""
    for run, linear in runs_of_points(stability, points):
        for unmarked, part in groupby(run, lambda index: points[index].pattern is None):
            if unmarked:
                yield list(part), linear


def marked_where_all_grow(stability: PointStability, points: list[SolutionPoint]) -> list[SolutionPoint]:
    """The points of a branch that the ring leaves everywhere, with an exponent that grows; else as given.

    Such a branch needs no exponents of the wave, and no bifurcations but folds. Some of its points are looked at:
    perturbations have to grow at all of them, at most of them clearly.
    """
    if not points or not stability.has_patterns(points[0]):
        return points
    places = sorted({*range(0, len(points), GROWING_STRIDE), len(points) - 1})
    found: dict[int, PatternExponent | None] = {}
    clear = 0
    for place in places:
        leading, omega = stability.worst_pattern(points[place], any_growing=True), points[place].omega
        if leading is None or not leading.grows(omega):
            return points
        clear += leading.grows_clearly(omega)
        found[place] = leading
    if 2 * clear <= len(places):
        return points
    for first, last in pairwise(places):
        _interpolate(points, found, first, last)
    return [point.changed(pattern=found[place]) for place, point in enumerate(points)]


def beside_state_changes(points: list[SolutionPoint], run: list[int]) -> set[int]:
    """The points, of some in a row, next to which a node begins or ceases to slip or to open.

    Exponents jump there, and a motion may be unstable for a point or two.
    """
    changes = [pair for pair in pairwise(run) if points[pair[1]].state_differs(points[pair[0]])]
    return {index for pair in changes for index in pair}


def middle_of(points: list[SolutionPoint], first: int, last: int) -> int:
    """Index of the point between two others that is nearest to the middle of the arc between them."""
    arc = 0.5 * (points[first].arc + points[last].arc)
    return min(range(first + 1, last), key=lambda index: abs(points[index].arc - arc))


def _fill_wave(recorder: PointRecorder, points: list[SolutionPoint], first: int, last: int) -> None:
    """Find the exponents between two points that have theirs."""
    if last - first < 2:
        return
    middle = middle_of(points, first, last)
    growing = _both_unstable(points, first, last)
    if growing:
        points[middle] = _with_growth_followed(recorder, points, first, middle, last)
    else:
        points[middle] = recorder.with_exponents(points[middle])
    alike = _grows_between if growing else _decays_between
    if alike(points, first, middle, last):
        _interpolate_wave(points, first, middle, growing)
        _interpolate_wave(points, middle, last, growing)
        return
    _fill_wave(recorder, points, first, middle)
    _fill_wave(recorder, points, middle, last)


def _interpolate_wave(points: list[SolutionPoint], first: int, last: int, growing: bool) -> None:
    """Give the points between two the leading exponent of these, linear in the arc length."""
    for index in range(first + 1, last):
        value = _wave_exponent_between(points, first, index, last)
        if growing:
            points[index] = _with_leading(points[index], value, points[_nearer(first, index, last)])
        else:
            points[index] = replace(points[index], exponents=np.array([value]))


def _both_unstable(points: list[SolutionPoint], first: int, last: int) -> bool:
    """Whether perturbations grow at two points, and no real exponent passes zero between them."""
    signs = {point.jacobian_sign for point in points[first : last + 1]}
    return len(signs) == 1 and points[first].unstable > 0 and points[last].unstable > 0


def _with_growth_followed(
    recorder: PointRecorder, points: list[SolutionPoint], first: int, index: int, last: int
) -> SolutionPoint:
    """A point between two at which exponents grow; with all of its exponents if none that grows is found."""
    point, stability = points[index], recorder.stability
    assert stability is not None
    start = _wave_exponent_between(points, first, index, last)
    found = stability.follow_wave(point, start)
    if found is None or not grows(np.array([found]), point.omega).all():
        return recorder.with_exponents(point)
    nearer = points[_nearer(first, index, last)]
    if not _same_kind(nearer, found):
        return recorder.with_exponents(point)
    return _with_leading(point, found, nearer)


def _nearer(first: int, index: int, last: int) -> int:
    return first if index - first <= last - index else last


def _growing(point: SolutionPoint) -> ComplexArray:
    """The exponents of a point that grow."""
    assert point.exponents is not None
    return point.exponents[grows(point.exponents, point.omega)]


def _same_kind(point: SolutionPoint, leading: complex) -> bool:
    """Whether the leading exponent of a point is real, or one of a pair, as another one."""
    return bool((_growing(point)[0].imag == 0.0) == (leading.imag == 0.0))


def _with_leading(point: SolutionPoint, leading: complex, nearer: SolutionPoint) -> SolutionPoint:
    """A point with its leading exponent; the others that grow are those of a point next to it."""
    own = with_conjugate(leading)
    values = np.append(own, _growing(nearer)[own.size :])
    return replace(point, exponents=values[np.argsort(-values.real)])


def _grows_between(points: list[SolutionPoint], first: int, middle: int, last: int) -> bool:
    """Whether the leading exponent grows from one point to another, and its rate in the middle is as interpolated."""
    three = [points[index] for index in (first, middle, last)]
    if not all(point.unstable for point in three):
        return False
    leading = [complex(_growing(point)[0]) for point in three]
    guess = _wave_exponent_between(points, first, middle, last)
    alike = abs(guess.real - leading[1].real) <= GROWTH_ERROR * min(value.real for value in leading)
    return alike and all(_same_kind(point, leading[1]) for point in three)


def _decays_between(points: list[SolutionPoint], first: int, middle: int, last: int) -> bool:
    """Whether all perturbations decay from one point to another, so that the rate in the middle is as interpolated.

    Its error is small against the distance from the imaginary axis of all three.
    """
    if any(point.jacobian_sign < 0 for point in points[first : last + 1]):
        return False
    rates = []
    for index in (first, middle, last):
        exponents = points[index].exponents
        if exponents is None or exponents.size == 0 or points[index].unstable:
            return False
        rates.append(float(exponents[0].real))
    error = abs(_wave_exponent_between(points, first, middle, last).real - rates[1])
    return error <= DECAY_ERROR * min(abs(rate) for rate in rates)


def _wave_exponent_between(points: list[SolutionPoint], first: int, index: int, last: int) -> complex:
    """The least stable exponent of a point, linear in the arc length between two others.

    Where these are of two families the frequency is that of the nearer.
    """
    before, point, after = points[first], points[index], points[last]
    assert before.exponents is not None
    assert after.exponents is not None
    one, other = complex(before.exponents[0]), complex(after.exponents[0])
    share = _share_of_arc(before, point, after)
    value = (1.0 - share) * one + share * other
    return value if _same_family(one, other, point) else complex(value.real, (one if share < 0.5 else other).imag)


def _share_of_arc(before: SolutionPoint, point: SolutionPoint, after: SolutionPoint) -> float:
    return (point.arc - before.arc) / (after.arc - before.arc) if after.arc > before.arc else 0.5


def _same_family(one: complex, other: complex, point: SolutionPoint) -> bool:
    return abs(one.imag - other.imag) <= SIMILAR_FREQUENCY * point.omega


def with_patterns(
    stability: PointStability, points: list[SolutionPoint], exact: Sequence[int] = ()
) -> list[SolutionPoint]:
    """The points of a branch with their least stable exponent over all nodal diameters but that of the wave.

    Points that have one already keep it.
    """
    found: dict[int, PatternExponent | None] = {index: point.pattern for index, point in enumerate(points)}
    for run, linear in _unmarked_runs(stability, points):
        for index in run:
            del found[index]
        chosen = {*run} if linear else _looked_at_first(points, run)
        _find(stability, points, found, sorted(chosen | (set(run) & {*exact})))
    return [replace(point, pattern=found[index]) for index, point in enumerate(points)]


def _looked_at_first(points: list[SolutionPoint], run: list[int]) -> set[int]:
    """The points, of some in a row, at which all nodal diameters are looked at first."""
    chosen = {*run[::GROWING_STRIDE], run[-1], *beside_state_changes(points, run)}
    for unstable, group in groupby(run, lambda index: _wave_grows(points[index])):
        stretch = list(group)
        if unstable and len(stretch) > GROWING_STRIDE:  # no flag changes there
            chosen -= {*stretch}
            stride = min(max(GROWING_STRIDE, len(stretch) // LOOKS), UNSTABLE_STRIDE)
            chosen |= {*stretch[::stride], stretch[-1]}
    return chosen


def _find(
    stability: PointStability,
    points: list[SolutionPoint],
    found: dict[int, PatternExponent | None],
    looked_at: list[int],
) -> None:
    """Find the exponents of the points looked at and of all between them."""
    for chosen in highest_first(points, looked_at):
        if chosen not in found:
            found[chosen] = stability.worst_pattern(points[chosen], any_growing=True)
    for first, last in pairwise(looked_at):
        ends = [(found[index], points[index].omega) for index in (first, last)]
        alike = all(one is not None and one.grows(omega) for one, omega in ends)
        if last - first > STRIDE and not alike and not all(map(_wave_grows, points[first : last + 1])):
            _find(stability, points, found, sorted({*range(first, last, STRIDE), last}))
        else:
            _fill(stability, points, found, first, last)


def _fill(
    stability: PointStability,
    points: list[SolutionPoint],
    found: dict[int, PatternExponent | None],
    first: int,
    last: int,
) -> None:
    """Find the exponents between two points that have theirs."""
    if last - first < 2:
        return
    one, other, middle = found[first], found[last], middle_of(points, first, last)
    if one is not None and other is not None and _changes_no_flag(points[first : last + 1], one, other):
        _interpolate(points, found, first, last)
        return
    found[middle] = None
    if one is not None and other is not None and _alike(points[first], points[last], one, other):
        guess = _between(points, (first, middle, last), one, other)
        followed = stability.follow_pattern(points[middle], guess)
        growing = one.grows(points[first].omega)
        if followed is not None and followed.grows(points[middle].omega) == growing:
            # a rate of growth is interpolated whatever it is: its sign is what matters
            similar = _similar_decay(points[first], one, other)
            alike = growing or _same_rate(followed.exponent.real, guess.exponent.real, similar)
            found[middle] = followed if alike else None
            if alike and last - first <= 2 * STRIDE:
                for ends in ((first, middle), (middle, last)):
                    _interpolate(points, found, *ends)
                return
    if found[middle] is None:
        found[middle] = stability.worst_pattern(points[middle], any_growing=True)
    _fill(stability, points, found, first, middle)
    _fill(stability, points, found, middle, last)


def _interpolate(
    points: list[SolutionPoint], found: dict[int, PatternExponent | None], first: int, last: int
) -> None:
    """Exponents between two points whose exponents are alike, linear in the arc length."""
    one, other = found[first], found[last]
    assert one is not None
    assert other is not None
    for index in range(first + 1, last):
        found[index] = _between(points, (first, index, last), one, other)


def _changes_no_flag(points: list[SolutionPoint], one: PatternExponent, other: PatternExponent) -> bool:
    """Whether the wave itself is unstable at all of these points, and an interpolated exponent suffices.

    It does where the rates of the first and the last point are nearly the same, or no larger than those of the wave.
    """
    if not all(map(_wave_grows, points)):
        return False
    own = [_growth_of_wave(points[end]) for end in (0, -1)]
    follows_wave = one.exponent.real <= own[0] and other.exponent.real <= own[1]
    return follows_wave or _same_rate(one.exponent.real, other.exponent.real, SIMILAR_DECAY)


def _wave_grows(point: SolutionPoint) -> bool:
    """Whether the wave itself is so unstable that no other nodal diameter changes a flag."""
    return bool(point.unstable) and _growth_of_wave(point) >= UNSTABLE_WAVE * point.omega


def _growth_of_wave(point: SolutionPoint) -> float:
    """Real part (1/s) of the least stable exponent of the wave."""
    assert point.exponents is not None
    return float(point.exponents[0].real)


def _alike(before: SolutionPoint, after: SolutionPoint, one: PatternExponent, other: PatternExponent) -> bool:
    """Whether the leading exponents of two points both grow, or decay at nearly the same rate.

    What decays slower than every mode without contact is fed by the contact forces, and may grow at another nodal
    diameter in the next point, unless its rate is steady: sliders that creep.
    """
    growing = one.grows(before.omega), other.grows(after.omega)
    if any(growing):
        return all(growing)
    return _same_rate(one.exponent.real, other.exponent.real, _similar_decay(before, one, other))


def _similar_decay(point: SolutionPoint, one: PatternExponent, other: PatternExponent) -> float:
    """Relative difference of two rates of decay, beside a point, between which one is interpolated."""
    free_decay = float(point.balance.receptance.modes.damping.min()) / 2.0
    slowest = max(one.exponent.real, other.exponent.real)
    return STEADY_DECAY if slowest > -AMPLIFIED * free_decay else SIMILAR_DECAY


def _same_rate(one: float, other: float, tolerance: float) -> bool:
    return abs(one - other) <= tolerance * max(abs(one), abs(other))


def _between(
    points: list[SolutionPoint], indices: tuple[int, int, int], one: PatternExponent, other: PatternExponent
) -> PatternExponent:
    """The exponent of the second of three points, linear in the arc length between those of the first and the last.

    Where these are of two families with nearly the same rate, frequency and nodal diameter are those of the nearer.
    """
    before, point, after = (points[index] for index in indices)
    share = _share_of_arc(before, point, after)
    exponent = (1.0 - share) * one.exponent + share * other.exponent
    if not _same_family(one.exponent, other.exponent, point):
        nearer = one if share < 0.5 else other
        return PatternExponent(complex(exponent.real, nearer.exponent.imag), nearer.nodal_diameter)
    k = round((1.0 - share) * one.nodal_diameter + share * other.nodal_diameter)
    return PatternExponent(exponent, k)


def locate_pattern_change(
    continuation: Continuation, before: SolutionPoint, after: SolutionPoint
) -> tuple[BifurcationKind, int, SolutionPoint] | None:
    """Where, between two neighbours, perturbations of a nodal diameter begin or cease to grow.

    Nothing where the wave itself is unstable at one of the two: then its own bifurcation is there. Nothing either
    beside points that the ring leaves for certain, which have no exponents of the wave.
    """
    stability = continuation.stability
    if stability is None or before.exponents is None or after.exponents is None:
        return None
    if before.undecided or after.undecided:
        return None
    if not (before.stable_wave and after.stable_wave) or before.stable == after.stable:
        return None
    change = None
    for _ in range(MAX_LOCATIONS):
        growing = before if after.stable else after
        leader = growing.pattern
        assert leader is not None

        def with_leader(point: SolutionPoint, start: PatternExponent = leader) -> SolutionPoint:
            recorded = continuation.recorder.record(point)
            followed = stability.follow_pattern(recorded, start)
            return replace(recorded, pattern=followed or stability.worst_pattern(recorded, any_growing=True))

        found = locate_change(
            continuation,
            before,
            after,
            lambda point: point.stable == after.stable,
            # beyond the error of a neutral exponent: it decays where the motion is stable
            rate=partial(_excess_rate, limit=-NEUTRAL if after.stable else NEUTRAL),
            record=with_leader,
        )
        if found is None:
            break
        if found is not after:
            found = _looked_at_again(continuation, stability, found)
        change = KINDS[instability_of(leader.exponent, growing.omega)], leader.nodal_diameter, found
        if found.stable == after.stable or not found.stable_wave:
            break
        before = found  # another nodal diameter still grows there
    return change


def _excess_rate(point: SolutionPoint, limit: float) -> float:
    """By how much the leading exponent exceeds a limit in units of omega, 1/s; NaN without one."""
    return float("nan") if point.pattern is None else point.pattern.exponent.real - limit * point.omega


def _looked_at_again(continuation: Continuation, stability: PointStability, point: SolutionPoint) -> SolutionPoint:
    """A point located by one exponent, with those of the wave and the least stable of all and that one."""
    known, worst = point.pattern, stability.worst_pattern(point, any_growing=True)
    if worst is None or (known is not None and known.exponent.real > worst.exponent.real):
        worst = known
    return replace(continuation.recorder.with_exponents(point), pattern=worst)
