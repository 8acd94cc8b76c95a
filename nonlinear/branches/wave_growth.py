"""Floquet exponents of the wave along a branch: all of them at some points, the leading one between these.

A real exponent that passes zero changes the sign of det dR/dx, which is known at every point. All exponents are
computed in some points and halfway between them. Where all of them decay, the leading one is interpolated between
these; where the rate halfway is not as interpolated, all are computed in more points. Where some grow at two of these
points, one of them is followed halfway, and the same is done with its rate.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby, pairwise

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.continuation.point_stability import PointRecorder, PointStability
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.stability.floquet import grows, with_conjugate

STRIDE = 8  # points from one whose exponents are computed to the next
DECAY_ERROR = 0.2  # relative error of a rate of decay, halfway between two others, that may be interpolated
GROWTH_ERROR = 0.05  # the same of a rate of growth
SIMILAR_FREQUENCY = 0.05  # difference of Im lambda, in units of omega, of two exponents of one family


def with_wave_exponents(
    recorder: PointRecorder, points: list[SolutionPoint], exact: Sequence[int] = ()
) -> list[SolutionPoint]:
    """The points of a branch with the exponents of perturbations that have the symmetry of the wave.

    Where all of them decay, that of the least stable one is interpolated; `exponents` has no others there. Where the
    leading one grows and is followed or interpolated, `exponents` has it, and the others that grow as at a point next
    to it.
    """
    if recorder.stability is None:
        return points
    result = list(points)
    for run, linear in runs_of_points(recorder.stability, points):
        chosen = {*run} if linear else {*run[::STRIDE], run[-1], *beside_state_changes(points, run)}
        looked_at = sorted(chosen | (set(run) & {*exact}))
        for index in looked_at:
            result[index] = recorder.with_exponents(points[index])
        for first, last in pairwise(looked_at):
            _fill(recorder, result, first, last)
    return result


def runs_of_points(stability: PointStability, points: list[SolutionPoint]) -> Iterator[tuple[list[int], bool]]:
    """Points in a row whose contacts change their state, or do not: their indices, and whether not."""
    for linear, run in groupby(range(len(points)), lambda index: stability.linear_state(points[index]) is not None):
        yield list(run), linear


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


def _fill(recorder: PointRecorder, points: list[SolutionPoint], first: int, last: int) -> None:
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
        _interpolate(points, first, middle, growing)
        _interpolate(points, middle, last, growing)
        return
    _fill(recorder, points, first, middle)
    _fill(recorder, points, middle, last)


def _interpolate(points: list[SolutionPoint], first: int, last: int, growing: bool) -> None:
    """Give the points between two the leading exponent of these, linear in the arc length."""
    for index in range(first + 1, last):
        value = _between(points, first, index, last)
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
    start = _between(points, first, index, last)
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
    guess = _between(points, first, middle, last)
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
    error = abs(_between(points, first, middle, last).real - rates[1])
    return error <= DECAY_ERROR * min(abs(rate) for rate in rates)


def _between(points: list[SolutionPoint], first: int, index: int, last: int) -> complex:
    """The least stable exponent of a point, linear in the arc length between two others.

    Where these are of two families the frequency is that of the nearer.
    """
    before, point, after = points[first], points[index], points[last]
    assert before.exponents is not None
    assert after.exponents is not None
    one, other = complex(before.exponents[0]), complex(after.exponents[0])
    share = (point.arc - before.arc) / (after.arc - before.arc) if after.arc > before.arc else 0.5
    value = (1.0 - share) * one + share * other
    if abs(one.imag - other.imag) > SIMILAR_FREQUENCY * point.omega:
        value = complex(value.real, (one if share < 0.5 else other).imag)
    return value
