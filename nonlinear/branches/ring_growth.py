"""The least stable nodal diameter at the points of a branch, and where perturbations of one begin to grow.

All nodal diameters are looked at in some points of a branch. Between two of them the leading exponent is followed to
the middle; where the exponents are not alike, more points are looked at, else the exponent is interpolated. Where the
wave itself is unstable, exponents of other nodal diameters change no flag: there the points looked at suffice.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby, pairwise

from nonlinear.branches.bifurcations import KINDS, BifurcationKind
from nonlinear.branches.special_point_location import locate_change
from nonlinear.branches.wave_growth import beside_state_changes, middle_of, runs_of_points
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.point_stability import PointStability
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.stability.floquet import NEUTRAL, instability_of
from nonlinear.stability.ring_stability import PatternExponent

STRIDE = 4  # points from one at which all nodal diameters are looked at to the next
GROWING_STRIDE = 16  # the same where perturbations grow at both: one exponent that grows is followed between them
UNSTABLE_STRIDE = 64  # the same in long stretches where the wave itself is unstable
LOOKS = 8  # at a shorter stretch
AMPLIFIED = 0.98  # share of the least decay without contact; what decays slower is fed by contact forces
SIMILAR_DECAY = 0.2  # relative difference of two rates of decay between which one is interpolated
SIMILAR_GROWTH = 0.05  # the same of an interpolated rate of growth
SIMILAR_FREQUENCY = 0.05  # difference of Im lambda, in units of omega, of two exponents of one family
UNSTABLE_WAVE = 1e-3  # growth of the wave, in units of omega, beside which other nodal diameters change no flag
MAX_LOCATIONS = 4  # nodal diameters that may take over from each other where the motion becomes unstable


def with_patterns(
    stability: PointStability, points: list[SolutionPoint], exact: Sequence[int] = ()
) -> list[SolutionPoint]:
    """The points of a branch with their least stable exponent over all nodal diameters but that of the wave."""
    found: dict[int, PatternExponent | None] = {}
    for run, linear in runs_of_points(stability, points):
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
    for chosen in looked_at:
        if chosen not in found:
            found[chosen] = stability.worst_pattern(points[chosen])
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
            tolerance = SIMILAR_GROWTH if growing else SIMILAR_DECAY
            alike = _same_rate(followed.exponent.real, guess.exponent.real, tolerance)
            found[middle] = followed if growing or alike else None
            if alike and last - first <= 2 * STRIDE:
                for ends in ((first, middle), (middle, last)):
                    _interpolate(points, found, *ends)
                return
    if found[middle] is None:
        found[middle] = stability.worst_pattern(points[middle])
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
    diameter in the next point.
    """
    growing = one.grows(before.omega), other.grows(after.omega)
    if any(growing):
        return all(growing)
    free_decay = float(before.balance.receptance.waves.damping.min()) / 2.0
    if max(one.exponent.real, other.exponent.real) > -AMPLIFIED * free_decay:
        return False
    return _same_rate(one.exponent.real, other.exponent.real, SIMILAR_DECAY)


def _same_rate(one: float, other: float, tolerance: float) -> bool:
    return abs(one - other) <= tolerance * max(abs(one), abs(other))


def _between(
    points: list[SolutionPoint], indices: tuple[int, int, int], one: PatternExponent, other: PatternExponent
) -> PatternExponent:
    """The exponent of the second of three points, linear in the arc length between those of the first and the last.

    Where these are of two families with nearly the same rate, frequency and nodal diameter are those of the nearer.
    """
    before, point, after = (points[index] for index in indices)
    share = (point.arc - before.arc) / (after.arc - before.arc) if after.arc > before.arc else 0.5
    exponent = (1.0 - share) * one.exponent + share * other.exponent
    if abs(one.exponent.imag - other.exponent.imag) > SIMILAR_FREQUENCY * point.omega:
        nearer = one if share < 0.5 else other
        return PatternExponent(complex(exponent.real, nearer.exponent.imag), nearer.nodal_diameter)
    k = round((1.0 - share) * one.nodal_diameter + share * other.nodal_diameter)
    return PatternExponent(exponent, k)


def locate_pattern_change(
    continuation: Continuation, before: SolutionPoint, after: SolutionPoint
) -> tuple[BifurcationKind, int, SolutionPoint] | None:
    """Where, between two neighbours, perturbations of a nodal diameter begin or cease to grow.

    Nothing where the wave itself is unstable at one of the two: then its own bifurcation is there.
    """
    stability = continuation.stability
    if stability is None or not (before.stable_wave and after.stable_wave) or before.stable == after.stable:
        return None
    change = None
    for _ in range(MAX_LOCATIONS):
        growing = before if after.stable else after
        leader = growing.pattern
        assert leader is not None

        def with_leader(point: SolutionPoint, start: PatternExponent = leader) -> SolutionPoint:
            recorded = continuation.recorder.record(point)
            followed = stability.follow_pattern(recorded, start, climb=False)
            return replace(recorded, pattern=followed or stability.worst_pattern(recorded))

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
    known, worst = point.pattern, stability.worst_pattern(point)
    if worst is None or (known is not None and known.exponent.real > worst.exponent.real):
        worst = known
    return replace(continuation.recorder.with_exponents(point), pattern=worst)
