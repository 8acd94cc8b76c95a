"""Detached branches: solutions that no path along the main curve reaches, sought from where linear theory peaks."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from nonlinear.contact import Array
from nonlinear.continuation import Continuation
from nonlinear.curve_point import CurvePoint
from nonlinear.linear_stretch import LinearState
from nonlinear.outcome import Ending, Outcome
from nonlinear.start import solve_at
from nonlinear.trace import Trace, joined, with_peaks
from nonlinear.tracing import Progress

MOST_ITERATIONS = 15
SAME_SOLUTION = 1e-6  # relative distance of two solutions that are one
WIDEST_SEGMENT = 2.0  # a solution farther than this many steps from a segment's chord does not lie on it


def detached_branches(
    continuation: Continuation, static: Array, known: list[Trace], progress: Progress | None = None
) -> list[Trace]:
    """Branches beside the `known` ones, traced both ways until they close, or leave the range.

    Newton's method starts at both ends of the range and at every natural frequency in it (`Continuation.landmarks`),
    from the open and from the stuck linear response. A solution on no branch known so far lies on a new one. This is
    a search, not a proof: a branch that none of these starts falls onto is not found.
    """
    found: list[Trace] = []
    for frequency, guess in _probes(continuation, static):
        solved = solve_at(continuation.balance, frequency, guess, continuation.options, MOST_ITERATIONS)
        if not solved.converged:
            continue
        traces = [*known, *found]
        if any(lies_on(continuation, trace.points, frequency, solved.solution) for trace in traces):
            continue
        trace = _trace_both_ways(continuation, frequency, solved.solution, progress)
        if trace is not None:
            found.append(trace)
    return found


def _probes(continuation: Continuation, static: Array) -> Iterator[tuple[float, Array]]:
    """Frequencies (rad/s) and first guesses."""
    balance = continuation.balance
    assert continuation.linear is not None
    stretches = continuation.linear.stretches
    low, high = continuation.span
    states = [LinearState(np.full(balance.n_contacts, pressed)) for pressed in (False, True)]
    statics = [stretches.static(state) for state in states]
    for frequency in (low, high, *continuation.landmarks):
        for state, harmonic_0 in zip(states, statics, strict=True):
            yield frequency, balance.unknown(stretches.solve(state, harmonic_0, frequency)[0])


def lies_on(continuation: Continuation, points: list[CurvePoint], frequency: float, unknown: Array) -> bool:
    """Whether the solution (x, w) is one of the traced curve."""
    metric = continuation.metric(unknown)
    for before, after in pairwise(points):
        low, high = sorted((before.frequency, after.frequency))
        if not low <= frequency <= high:
            continue
        share = (frequency - before.frequency) / (after.frequency - before.frequency) if high > low else 0.5
        between = before.unknown + share * (after.unknown - before.unknown)
        reach = WIDEST_SEGMENT * metric.norm(after.unknown - before.unknown, after.frequency - before.frequency)
        if metric.norm(between - unknown, 0.0) > reach + SAME_SOLUTION:
            continue
        solved = solve_at(continuation.balance, frequency, between, continuation.options, MOST_ITERATIONS)
        if solved.converged and metric.norm(solved.solution - unknown, 0.0) <= SAME_SOLUTION:
            return True
    return False


def _trace_both_ways(
    continuation: Continuation, frequency: float, unknown: Array, progress: Progress | None
) -> Trace | None:
    """The branch through a solution: closed, or from one end to the other; None where not even a step is found."""
    points = list(continuation.trace(continuation.onward(unknown, frequency, 1.0, 0), progress))
    closed = len(points) > 2 and points[-1].unknown is points[0].unknown
    if not closed:
        points = joined(list(continuation.trace(continuation.onward(unknown, frequency, -1.0, 0), progress)), points)
    if len(points) < 2:
        return None
    return with_peaks(continuation, points, _outcome(continuation, points, closed))


def _outcome(continuation: Continuation, points: list[CurvePoint], closed: bool) -> Outcome:
    low, high = continuation.options.frequency
    hertz = [point.frequency / (2.0 * np.pi) for point in points]
    ends = (hertz[0], hertz[-1])
    complete = closed or all(min(abs(end - low), abs(end - high)) <= 1e-9 * end for end in ends)
    kind = "closed" if closed else "open" if complete else "not traced to its end"
    message = f"detached branch, {kind}: {min(hertz):.6g} to {max(hertz):.6g} Hz in {len(points)} points"
    return Outcome(Ending.COMPLETE if complete else Ending.STEP_TOO_SMALL, ends[-1], message)
