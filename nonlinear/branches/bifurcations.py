"""Bifurcations of a response curve: folds, and other losses of stability."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np

from nonlinear.branches.special_point_location import locate_change, locate_zero
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.stability.floquet import Instability, crossings, growth_limit, with_conjugate

SAME_EXPONENT = 0.02  # distance of two values of one exponent, in units of omega


class BifurcationKind(Enum):
    """Kind of a bifurcation. The value is its name in text and files.

    Examples
    --------
    >>> from nonlinear import BifurcationKind
    >>> BifurcationKind("fold") is BifurcationKind.FOLD
    True
    """

    FOLD = "fold"
    BRANCH_POINT = "branch point"
    NEIMARK_SACKER = "Neimark-Sacker"
    PERIOD_DOUBLING = "period doubling"


KINDS = {
    Instability.REAL: BifurcationKind.BRANCH_POINT,
    Instability.COMPLEX: BifurcationKind.NEIMARK_SACKER,
    Instability.PERIOD_DOUBLING: BifurcationKind.PERIOD_DOUBLING,
}


@dataclass(frozen=True)
class Bifurcation:
    """A bifurcation of a response curve.

    At a fold the curve turns back in frequency. At a branch point another branch crosses it. Beyond a Neimark-Sacker
    bifurcation the motion is quasi-periodic, beyond a period doubling it repeats after two periods.

    Attributes
    ----------
    kind : BifurcationKind
        Kind of the bifurcation.
    frequency_hz : float
        Frequency, Hz.
    amplitude_m : float
        Amplitude of the output, m.
    index : int
        Index among the points of the curve.
    nodal_diameter : int
        k of the perturbation that begins or ceases to grow: beside that of the wave, its phase shift from blade to
        blade is 2 pi k / N_b. 0: it has the symmetry of the wave. k > 0: the blades stop moving alike, in another
        periodic motion beyond a branch point, in a quasi-periodic one beyond a Neimark-Sacker bifurcation.

    Examples
    --------
    Of a `ResponseCurve` they are `curve.bifurcations`.

    >>> from nonlinear import Bifurcation, BifurcationKind
    >>> fold = Bifurcation(BifurcationKind.FOLD, frequency_hz=201.5, amplitude_m=3e-4, index=17, nodal_diameter=0)
    >>> print(f"{fold.kind.value} at {fold.frequency_hz} Hz")
    fold at 201.5 Hz
    """

    kind: BifurcationKind
    frequency_hz: float
    amplitude_m: float
    index: int
    nodal_diameter: int = 0


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
    if before.exponents is None or after.exponents is None:
        return
    unstable, rank = before.unstable, min(before.unstable, after.unstable)
    stays_unstable = not before.stable_wave and not after.stable_wave
    for kind in _crossings(before, after):
        if kind is BifurcationKind.BRANCH_POINT and has_fold:
            continue  # the real exponent that passes zero is that of the fold
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
