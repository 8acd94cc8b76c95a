"""Detached branches: solutions that no path along the main curve reaches, sought from where linear theory peaks."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from nonlinear.branches.branch import Branch, joined, with_special_points
from nonlinear.branches.range_continuation import Progress, continue_over_range
from nonlinear.branches.termination import TerminationReason
from nonlinear.contact.parameters import Array
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.balance_family import BalanceFamily, fitted
from nonlinear.harmonic_balance.initial_solution import solve_at

MOST_ITERATIONS = 15
FEW_HARMONICS = 3
SAME_SOLUTION = 1e-6  # relative distance of two solutions that are one
SAME_END = 1e-2  # the same of ends, whose numbers of harmonics may differ
WIDEST_SEGMENT = 2.0  # a solution farther than this many steps, and a little, from a segment's chord is not on it
NEAR = 0.1


def detached_branches(
    continuation: Continuation,
    family: BalanceFamily,
    known: list[Branch],
    static: Array,
    progress: Progress | None = None,
) -> list[Branch]:
    """Branches beside the `known` ones, traced both ways until they close, or leave the range.

    Newton's method starts at both ends of the range and at every natural frequency in it, from the open and from the
    stuck linear response, with few harmonics at first; and at the peaks of the curve with fewer harmonics, traced
    from the displacement `static` (n_c, 3): where a few harmonics more cut a high response off, that curve still goes
    up there. A solution on no branch known so far lies on a new one. It is a search, not a proof: a branch that none
    of these starts falls onto is not found.
    """
    most = max((point.balance.n_harmonics for trace in known for point in trace.points), default=0)
    found: list[Branch] = []
    if most == 0:
        return found
    few, all_kept = (continuation.of(family.balance(n)) for n in (min(most, FEW_HARMONICS), most))
    for omega, guess in _probes(continuation):
        solution = _another(few, [*known, *found], omega, guess)
        if solution is not None and few.balance is not all_kept.balance:
            solution = _another(all_kept, [*known, *found], omega, solution)
        if solution is not None:
            _add(all_kept, known, found, (omega, solution), progress)
    if most > 1:
        fewer = family.balance(FEW_HARMONICS if most > FEW_HARMONICS else 1)
        for point in _peaks(replace(continuation.of(fewer), stability=None), static):
            same = all_kept.refit(point)
            if same is not None and not _is_known(all_kept, [*known, *found], same.omega, same.unknown):
                _add(all_kept, known, found, (same.omega, same.unknown), progress)
    return found


def _add(
    here: Continuation,
    known: list[Branch],
    found: list[Branch],
    solution: tuple[float, Array],
    progress: Progress | None,
) -> None:
    """Branch the branch through a solution (w, x); one more of those found, if it is no part of another."""
    trace = _trace_both_ways(here, *solution, progress)
    if not any(_share_an_end(here, trace, other) for other in (*known, *found)):
        found.append(trace)


def _peaks(continuation: Continuation, static: Array) -> Iterator[SolutionPoint]:
    """The peaks of the main curve."""
    for trace in continue_over_range(continuation, static):
        for index in trace.peak_indices:
            yield trace.points[index]


def _share_an_end(here: Continuation, one: Branch, other: Branch) -> bool:
    """Whether two traces end at the same place: then they are one curve, which a probe mistook for another."""
    for mine in (one.points[0], one.points[-1]):
        metric = here.metric(fitted(mine.unknown, here.balance))
        for yours in (other.points[0], other.points[-1]):
            apart = fitted(mine.unknown, here.balance) - fitted(yours.unknown, here.balance)
            if metric.norm(apart, mine.omega - yours.omega) <= SAME_END:
                return True
    return False


def _another(here: Continuation, known: list[Branch], omega: float, guess: Array) -> Array | None:
    """The solution that Newton's method finds from a guess, if it is none of the known branches."""
    start = fitted(guess, here.balance)
    solved = solve_at(here.balance, omega, start, here.options, MOST_ITERATIONS)
    if not solved.converged or _is_known(here, known, omega, solved.solution):
        return None
    return solved.solution


def _is_known(here: Continuation, known: list[Branch], omega: float, unknown: Array) -> bool:
    """Whether the solution (x, w) lies on one of the branches."""
    return any(lies_on(here, trace.points, omega, unknown) for trace in known)


def _probes(continuation: Continuation) -> Iterator[tuple[float, Array]]:
    """Frequencies (rad/s) and first guesses."""
    if continuation.linear is None:
        return
    balance, systems = continuation.balance, continuation.linear.stretches.uniform()
    low, high = continuation.span
    for omega in (low, high, *continuation.resonances.natural):
        for system in systems:
            yield omega, balance.unknown(system.motion(omega).displacement)


def lies_on(here: Continuation, points: list[SolutionPoint], omega: float, unknown: Array) -> bool:
    """Whether the solution (x, w) is one of the traced curve, whose points may have other numbers of harmonics."""
    metric = here.metric(unknown)
    for before, after in pairwise(points):
        low, high = sorted((before.omega, after.omega))
        if not low <= omega <= high:
            continue
        one, other = fitted(before.unknown, here.balance), fitted(after.unknown, here.balance)
        share = (omega - before.omega) / (after.omega - before.omega) if high > low else 0.5
        between = one + share * (other - one)
        reach = WIDEST_SEGMENT * metric.norm(other - one, after.omega - before.omega)
        if metric.norm(between - unknown, 0.0) > reach + NEAR:
            continue
        solved = solve_at(here.balance, omega, between, here.options, MOST_ITERATIONS)
        if solved.converged and metric.norm(solved.solution - unknown, 0.0) <= SAME_SOLUTION:
            return True
    return False


def _trace_both_ways(continuation: Continuation, omega: float, unknown: Array, progress: Progress | None) -> Branch:
    """The branch through a solution: closed, or from one end to the other."""
    points = list(continuation.trace(continuation.onward(unknown, omega, 1.0, 0), progress))
    closed = len(points) > 2 and points[-1].unknown is points[0].unknown
    if not closed:
        points = joined(list(continuation.trace(continuation.onward(unknown, omega, -1.0, 0), progress)), points)
    return with_special_points(continuation, points, _outcome(continuation, points, closed))


def _outcome(continuation: Continuation, points: list[SolutionPoint], closed: bool) -> TerminationReason:
    low, high = continuation.options.frequency_hz
    hertz = [point.omega / (2.0 * np.pi) for point in points]
    ends = (hertz[0], hertz[-1])
    complete = closed or all(min(abs(end - low), abs(end - high)) <= 1e-9 * end for end in ends)
    kind = "closed" if closed else "open" if complete else "not traced to its end"
    message = f"detached branch, {kind}: {min(hertz):.6g} to {max(hertz):.6g} Hz in {len(points)} points"
    return TerminationReason("complete" if complete else "step too small", ends[-1], message)
