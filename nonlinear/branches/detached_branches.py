"""Search for isolated branches (isolas), which no continuation of the main branch reaches.

An isolated branch (isola) is a closed curve. A branch that is not known to close is called a detached branch: it may
leave the frequency range, and be connected with the main branch outside of it.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from nonlinear.branches.branch import Branch, join, with_special_points
from nonlinear.branches.range_continuation import continue_over_range
from nonlinear.branches.termination import TerminationReason
from nonlinear.contact.parameters import Array
from nonlinear.continuation.arclength_continuation import Continuation, Progress
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.initial_solution import solve_at
from nonlinear.harmonic_balance.truncated_balances import TruncatedBalances, pad_or_truncate

MAX_ITERATIONS = 15
FEW_HARMONICS = 3
SAME_SOLUTION = 1e-6  # relative distance of two solutions that count as one
SAME_END = 1e-2  # the same of ends of branches, whose numbers of harmonics may differ
MAX_CHORDS = 2.0  # distance from the chord of two points, in its lengths, that a solution between them may have
MIN_DISTANCE = 0.1  # added to that, relative to the vibration


def detached_branches(
    continuation: Continuation,
    balances: TruncatedBalances,
    known: list[Branch],
    static: Array,
    progress: Progress | None = None,
) -> list[Branch]:
    """Isolated and detached branches, each continued in both directions until it closes or leaves the range.

    There are two kinds of starting points. The first are linear responses, with all contacts open and with all
    contacts stuck, at both ends of the range and at every natural frequency in it; Newton's method takes them to a
    solution with few harmonics, and from there to all harmonics. The second are the peaks of the main branch with
    fewer harmonics: with few harmonics a curve may still connect to a high response that becomes isolated with more.
    A solution on no known branch lies on a new one. The search is no proof: a branch that none of these starting
    points leads to is not found.

    Parameters
    ----------
    continuation : Continuation
        The continuation of the main branch.
    balances : TruncatedBalances
        The balances with other numbers of harmonics.
    known : list of Branch
        Branches found so far.
    static : (n_c, 3) float
        Static displacement from which the main branch with fewer harmonics starts, m.
    progress : callable, optional
        Called with the frequency (Hz) and the number of points at each new point.
    """
    most = max((point.balance.n_harmonics for branch in known for point in branch.points), default=0)
    found: list[Branch] = []
    if most == 0:
        return found
    coarse, full = (continuation.with_balance(balances.balance(n)) for n in (min(most, FEW_HARMONICS), most))
    for omega, guess in _linear_guesses(continuation):
        solution = _new_solution(coarse, [*known, *found], omega, guess)
        if solution is not None and coarse.balance is not full.balance:
            solution = _new_solution(full, [*known, *found], omega, solution)
        if solution is not None:
            _add(full, known, found, (omega, solution), progress)
    if most > 1:
        fewer = balances.balance(FEW_HARMONICS if most > FEW_HARMONICS else 1)
        for peak in _peaks_of_main_branch(replace(continuation.with_balance(fewer), stability=None), static):
            point = full.solver.refit(peak)
            if point is not None and not _is_known(full, [*known, *found], point.omega, point.unknown):
                _add(full, known, found, (point.omega, point.unknown), progress)
    return found


def _add(
    continuation: Continuation,
    known: list[Branch],
    found: list[Branch],
    solution: tuple[float, Array],
    progress: Progress | None,
) -> None:
    """Continue the branch through a solution (omega, x); append it unless it is part of another branch."""
    branch = _continue_both_ways(continuation, *solution, progress)
    if not any(_share_an_end(continuation, branch, other) for other in (*known, *found)):
        found.append(branch)


def _peaks_of_main_branch(continuation: Continuation, static: Array) -> Iterator[SolutionPoint]:
    """The peaks of the main branch."""
    for branch in continue_over_range(continuation, static):
        for index in branch.peak_indices:
            yield branch.points[index]


def _share_an_end(continuation: Continuation, one: Branch, other: Branch) -> bool:
    """Whether two branches have a common end: then they are one curve, although the solution seemed to be new."""
    balance = continuation.balance
    for end in (one.points[0], one.points[-1]):
        unknown = pad_or_truncate(end.unknown, balance)
        metric = continuation.solver.metric(unknown)
        for other_end in (other.points[0], other.points[-1]):
            difference = unknown - pad_or_truncate(other_end.unknown, balance)
            if metric.norm(difference, end.omega - other_end.omega) <= SAME_END:
                return True
    return False


def _new_solution(continuation: Continuation, known: list[Branch], omega: float, guess: Array) -> Array | None:
    """The solution to which Newton's method leads from a guess, if it lies on none of the known branches."""
    balance = continuation.balance
    solved = solve_at(balance, omega, pad_or_truncate(guess, balance), continuation.options, MAX_ITERATIONS)
    if not solved.converged or _is_known(continuation, known, omega, solved.solution):
        return None
    return solved.solution


def _is_known(continuation: Continuation, known: list[Branch], omega: float, unknown: Array) -> bool:
    """Whether the solution (x, omega) lies on one of the branches."""
    return any(lies_on(continuation, branch.points, omega, unknown) for branch in known)


def _linear_guesses(continuation: Continuation) -> Iterator[tuple[float, Array]]:
    """Frequencies (rad/s) and the linear responses there."""
    if continuation.linear is None:
        return
    balance, systems = continuation.balance, continuation.linear.segments.uniform()
    low, high = continuation.options.omega_range
    for omega in (low, high, *continuation.resonances.natural):
        for system in systems:
            yield omega, balance.unknown(system.motion(omega).displacement)


def lies_on(continuation: Continuation, points: list[SolutionPoint], omega: float, unknown: Array) -> bool:
    """Whether the solution (x, omega) lies on the curve of points, which may have other numbers of harmonics."""
    balance, metric = continuation.balance, continuation.solver.metric(unknown)
    for before, after in pairwise(points):
        low, high = sorted((before.omega, after.omega))
        if not low <= omega <= high:
            continue
        first, last = pad_or_truncate(before.unknown, balance), pad_or_truncate(after.unknown, balance)
        fraction = (omega - before.omega) / (after.omega - before.omega) if high > low else 0.5
        guess = first + fraction * (last - first)
        max_distance = MAX_CHORDS * metric.norm(last - first, after.omega - before.omega) + MIN_DISTANCE
        if metric.norm(guess - unknown, 0.0) > max_distance:
            continue
        solved = solve_at(balance, omega, guess, continuation.options, MAX_ITERATIONS)
        if solved.converged and metric.norm(solved.solution - unknown, 0.0) <= SAME_SOLUTION:
            return True
    return False


def _continue_both_ways(
    continuation: Continuation, omega: float, unknown: Array, progress: Progress | None
) -> Branch:
    """The branch through a solution: closed, or from one end to the other."""
    start = continuation.solver.starting_point(unknown, omega, 1.0, 0)
    points = list(continuation.continue_branch(start, progress))
    closed = len(points) > 2 and points[-1].unknown is points[0].unknown
    if not closed:
        start = continuation.solver.starting_point(unknown, omega, -1.0, 0)
        points = join(list(continuation.continue_branch(start, progress)), points)
    return with_special_points(continuation, points, _termination(continuation, points, closed))


def _termination(continuation: Continuation, points: list[SolutionPoint], closed: bool) -> TerminationReason:
    """Why a detached branch ended."""
    low, high = continuation.options.frequency_hz
    frequencies = [point.omega / (2.0 * np.pi) for point in points]
    ends = (frequencies[0], frequencies[-1])
    complete = closed or all(min(abs(end - low), abs(end - high)) <= 1e-9 * end for end in ends)
    shape = "closed" if closed else "open" if complete else "not traced to its end"
    span = f"{min(frequencies):.6g} to {max(frequencies):.6g} Hz in {len(points)} points"
    return TerminationReason(
        "complete" if complete else "step too small", ends[-1], f"detached branch, {shape}: {span}"
    )
