"""Bifurcations of a response curve: folds, and where the motion loses its stability in another way."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

from nonlinear.branches.special_point_location import locate_change, locate_zero
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.solution_point import SolutionPoint


class BifurcationKind(Enum):
    """What happens there. The value is the name for people and files."""

    FOLD = "fold"
    BRANCH_POINT = "branch point"
    NEIMARK_SACKER = "Neimark-Sacker"
    PERIOD_DOUBLING = "period doubling"


@dataclass(frozen=True)
class Bifurcation:
    """A bifurcation; `index` is its place among the curve's points.

    `kind`: what happens there; `frequency_hz`, `amplitude_m`: where. A fold turns the frequency round. At a branch
    point another family of motions leaves. Beyond a Neimark-Sacker bifurcation the motion has a second frequency,
    beyond a period doubling every other cycle is another one.
    """

    kind: BifurcationKind
    frequency_hz: float
    amplitude_m: float
    index: int


def locate_bifurcations(
    continuation: Continuation, before: SolutionPoint, after: SolutionPoint
) -> Iterator[tuple[BifurcationKind, SolutionPoint]]:
    """Bifurcations between two neighbouring points, each as its kind and the point there."""
    turns = before.tangent[1] * after.tangent[1] < 0.0
    if turns:
        fold = locate_zero(continuation, before, after, lambda point: point.tangent[1])
        if fold is not None:
            yield BifurcationKind.FOLD, fold
    if before.exponents is None or after.exponents is None:
        return
    unstable = before.unstable
    for kind in _crossings(before, after):
        if kind is BifurcationKind.BRANCH_POINT and turns:
            continue  # the real exponent that passes zero is that of the fold
        found = locate_change(continuation, before, after, lambda point: point.unstable != unstable)
        if found is not None:
            yield kind, found


def _crossings(before: SolutionPoint, after: SolutionPoint) -> list[BifurcationKind]:
    from nonlinear.stability.floquet import Instability, crossings

    assert before.exponents is not None
    assert after.exponents is not None
    kinds = {
        Instability.REAL: BifurcationKind.BRANCH_POINT,
        Instability.COMPLEX: BifurcationKind.NEIMARK_SACKER,
        Instability.PERIOD_DOUBLING: BifurcationKind.PERIOD_DOUBLING,
    }
    return [kinds[item] for item in crossings(before.exponents, after.exponents, after.omega)]
