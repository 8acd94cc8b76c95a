"""The least stable nodal diameter at the points of a branch, and where perturbations of one begin to grow.

All nodal diameters are looked at in some points of a branch. Between two of them the leading exponent is followed;
where the two differ, more points are looked at.
"""

from dataclasses import replace
from itertools import pairwise

from nonlinear.branches.bifurcations import KINDS, BifurcationKind
from nonlinear.branches.special_point_location import locate_change
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.point_stability import PointStability
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.stability.floquet import instability_of
from nonlinear.stability.ring_stability import PatternExponent

STRIDE = 8  # points from one at which all nodal diameters are looked at to the next
SIMILAR_RATE = 0.2  # relative difference of two rates of decay that says that nothing has happened between them
SIMILAR_FREQUENCY = 0.05  # difference of Im lambda, in units of omega, of two exponents of one family
MAX_LOCATIONS = 4  # nodal diameters that may take over from each other where the motion becomes unstable


def with_patterns(stability: PointStability, points: list[SolutionPoint]) -> list[SolutionPoint]:
    """The points of a branch with their least stable exponent over all nodal diameters but that of the wave.

    Parameters
    ----------
    stability : PointStability
        Computes it.
    points : list of SolutionPoint
        In the order of the branch.
    """
    found: dict[int, PatternExponent | None] = {}
    run: list[int] = []
    for index, point in enumerate(points):
        if stability.linear_state(point) is not None:
            found[index] = stability.worst_pattern(point)
        else:
            run.append(index)
        if run and (run[-1] != index or index == len(points) - 1):
            looked_at = sorted({*run[::STRIDE], run[-1]})
            for chosen in looked_at:
                found[chosen] = stability.worst_pattern(points[chosen])
            for first, last in pairwise(looked_at):
                _fill(stability, points, found, first, last)
            run = []
    return [replace(point, pattern=found[index]) for index, point in enumerate(points)]


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
    one, other, middle = found[first], found[last], (first + last) // 2
    if one is not None and other is not None and _alike(points[first], points[last], one, other):
        growing = one.grows(points[first].omega)
        for index in range(first + 1, last):
            point = points[index]
            share = (point.arc - points[first].arc) / (points[last].arc - points[first].arc)
            followed = stability.follow_pattern(point, _between(point.omega, share, one, other))
            if followed is None or followed.grows(point.omega) != growing:
                middle = index
                break
            found[index] = followed
        else:
            return
    found[middle] = stability.worst_pattern(points[middle])
    _fill(stability, points, found, first, middle)
    _fill(stability, points, found, middle, last)


def _alike(before: SolutionPoint, after: SolutionPoint, one: PatternExponent, other: PatternExponent) -> bool:
    """Whether the leading exponents of two points both grow, or decay at nearly the same rate."""
    growing = one.grows(before.omega), other.grows(after.omega)
    if any(growing):
        return all(growing)
    rates = one.exponent.real / before.omega, other.exponent.real / after.omega
    return abs(rates[0] - rates[1]) <= SIMILAR_RATE * max(abs(rates[0]), abs(rates[1]))


def _between(omega: float, share: float, first: PatternExponent, last: PatternExponent) -> list[PatternExponent]:
    """Where the exponent of a point between two others is looked for."""
    if abs(first.exponent.imag - last.exponent.imag) > SIMILAR_FREQUENCY * omega:
        return [first, last]
    exponent = (1.0 - share) * first.exponent + share * last.exponent
    k = round((1.0 - share) * first.nodal_diameter + share * last.nodal_diameter)
    return [PatternExponent(exponent, k)]


def locate_pattern_change(
    continuation: Continuation, before: SolutionPoint, after: SolutionPoint
) -> tuple[BifurcationKind, int, SolutionPoint] | None:
    """Where, between two neighbours, perturbations of a nodal diameter begin or cease to grow.

    Nothing where the wave itself is unstable at one of the two: then its own bifurcation is there.

    Returns
    -------
    kind, nodal_diameter, point
        Kind of the bifurcation, nodal diameter of the perturbation, the point there; None: there is no change.
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
            return replace(recorded, pattern=stability.follow_pattern(recorded, [start]))

        found = locate_change(
            continuation,
            before,
            after,
            lambda point: point.stable == after.stable,
            rate=lambda point: float("nan") if point.pattern is None else point.pattern.exponent.real,
            record=with_leader,
        )
        if found is None:
            break
        if found is not after:
            found = replace(found, pattern=stability.worst_pattern(found))
        change = KINDS[instability_of(leader.exponent, growing.omega)], leader.nodal_diameter, found
        if found.stable == after.stable or not found.stable_wave:
            break
        before = found  # another nodal diameter still grows there
    return change
