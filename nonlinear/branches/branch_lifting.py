"""Branches found with few harmonics, lifted to more harmonics from several of their points."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from nonlinear.branches.branch_collection import BranchCollection
from nonlinear.contact.parameters import Array
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.response_quantities import output_amplitude
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.initial_solution import solve_at
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.harmonic_balance.truncated_balances import TruncatedBalances, pad_or_truncate

EVENLY = 8  # points of a branch evenly along it, beside its top, ends and folds
EVENLY_FROM_ONE = 16  # the same where there is one harmonic only, far from more: few of its points lead anywhere
CLOSE = 0.01  # distance from a known branch, relative to the vibration, within which a point is not lifted
MAX_ITERATIONS = 15


@dataclass(frozen=True)
class Lifting:
    """How solutions with few harmonics get more."""

    balances: TruncatedBalances  # the balances by number of harmonics
    # numbers of harmonics, ascending, up to the first one that changes the amplitude by no more than `tolerance`
    numbers: tuple[int, ...]
    tolerance: float = 0.0  # relative change of the amplitude; 0: always up to the last number

    def lift(self, continuation: Continuation, point: SolutionPoint) -> SolutionPoint | None:
        """The solution with as many harmonics as it needs; None where Newton's method finds none."""
        output = continuation.options.output
        amplitude = output_amplitude(point, output)
        lifted: SolutionPoint | None = None
        few = point.balance.n_harmonics
        more = [n for n in self.numbers if n > few] if self.tolerance > 0.0 else []
        for number in more or self.numbers[-1:]:
            balance = self.balances.balance(number)
            found = point if number == few else with_balance(continuation, point, balance)
            if found is None:
                continue
            before, amplitude, lifted, point = amplitude, output_amplitude(found, output), found, found
            if abs(amplitude - before) <= self.tolerance * amplitude:
                break
        return lifted


def with_balance(continuation: Continuation, point: SolutionPoint, balance: HarmonicBalance) -> SolutionPoint | None:
    """The solution of a balance nearest to a point: in the plane normal to its tangent, else at its frequency."""
    solver = continuation.with_balance(balance).solver
    found = solver.refit(point)
    if found is not None:
        return found
    guess, omega = pad_or_truncate(point.unknown, balance), point.omega
    solved = solve_at(balance, omega, guess, continuation.options, MAX_ITERATIONS)
    if not solved.converged:
        return None
    tangent = pad_or_truncate(point.tangent[0], balance), point.tangent[1]
    return solver.point(solved.solution, omega, tangent, solved.iterations, 0.0, continuation.options.step)


def lift_branch(collection: BranchCollection, lifting: Lifting, points: list[SolutionPoint], origin: str) -> None:
    """Add to a collection what the points of a branch with few harmonics lead to."""
    for point in representative_points(points, collection.continuation.options.output):
        if collection.is_known(point, CLOSE):
            continue
        lifted = lifting.lift(collection.continuation, point)
        if lifted is not None:
            collection.offer(lifted, origin)


def representative_points(points: list[SolutionPoint], output: str) -> Iterator[SolutionPoint]:
    """Points that stand for a branch: its top first, its ends, its folds, and some evenly along it."""
    evenly = EVENLY if points[0].balance.n_harmonics > 1 else EVENLY_FROM_ONE
    amplitude = np.array([output_amplitude(point, output) for point in points])
    omega, arc = np.array([point.omega for point in points]), np.array([point.arc for point in points])
    return (points[place] for place in representative_indices(amplitude, omega, arc, evenly))


def representative_indices(
    amplitude: Sequence[float] | Array,
    omega: Sequence[float] | Array,
    arc: Sequence[float] | Array,
    evenly: int = EVENLY,
) -> list[int]:
    """Indices of points that stand for a branch, see `representative_points`.

    Shapes: `amplitude` (P,), `omega` (P,), `arc` (P,).
    """
    heights, arcs = np.asarray(amplitude), np.asarray(arc)
    last = len(heights) - 1
    if last < 0:
        return []
    steps = np.diff(np.asarray(omega))
    folds = [index + 1 for index, (one, other) in enumerate(pairwise(steps)) if one * other < 0.0]
    spread = np.searchsorted(arcs, np.linspace(arcs[0], arcs[-1], evenly + 2)[1:-1])
    places = [int(np.argmax(heights)), 0, last, *folds, *(min(int(place), last) for place in spread)]
    return list(dict.fromkeys(places))
