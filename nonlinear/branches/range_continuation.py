"""The main branch over the whole frequency range: from the low end, and where that fails, from the high end."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from nonlinear.branches.branch import Branch, with_special_points
from nonlinear.contact.parameters import Array
from nonlinear.continuation.arclength_continuation import Continuation, Progress
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.initial_solution import periodic_start
from nonlinear.options import SolverOptions
from nonlinear.response_curve import TerminationReason

FINER_MAX_STEP = 4.0  # ratio of the longest steps of the first and of the finer attempts
FINER_MIN_STEP = 100.0  # the same of the shortest steps


@dataclass
class _Patience:
    """Passes the progress on, and remembers where that has given up."""

    progress: Progress | None
    is_gone: bool = False

    def __call__(self, frequency_hz: float, count: int) -> bool:
        self.is_gone = self.is_gone or bool(self.progress is not None and self.progress(frequency_hz, count))
        return self.is_gone


class Attempt(NamedTuple):
    """One attempt to continue the main branch: its name, direction in frequency and options."""

    name: str
    upwards: bool
    options: SolverOptions


def continue_over_range(continuation: Continuation, static: Array, progress: Progress | None = None) -> list[Branch]:
    """Continue the main branch from one end of the frequency range to the other.

    It starts at the low end. If the high end is not reached, it starts there, then with finer steps at either end.
    `progress` is asked before each further attempt too, with 0 points; where it returns True, the branch is given up.
    Shapes: `static` (n_c, 3).
    """
    failed: list[tuple[Attempt, Branch]] = []
    patience = _Patience(progress)
    for attempt in _attempts(continuation.options):
        if failed and patience(failed[-1][1].termination.frequency_hz, 0):
            break
        branch = _continue_from_end(replace(continuation, options=attempt.options), static, attempt.upwards, patience)
        if branch.termination.complete:
            return [_in_rising_order(branch, _with_failures(attempt, branch, failed))]
        failed.append((attempt, branch))
        if branch.termination.kind in ("too many points", "too large") or continuation.budget.is_spent:
            break
    attempt, longest = max(failed, key=lambda item: len(item[1].points))
    others = [item for item in failed if item[1] is not longest]
    far_side = [branch for other, branch in others if other.upwards != attempt.upwards and branch.points]
    branches = sorted(far_side, key=lambda branch: -len(branch.points))[:1]
    longest = longest._replace(termination=_with_failures(attempt, longest, others))
    return [_in_rising_order(branch, branch.termination) for branch in (longest, *branches)]


def _attempts(options: SolverOptions) -> list[Attempt]:
    """The attempts in their order."""
    finer = replace(options, max_step=options.max_step / FINER_MAX_STEP, min_step=options.min_step / FINER_MIN_STEP)
    return [
        Attempt("from the low end up", True, options),
        Attempt("from the high end down", False, options),
        Attempt("from the low end up with finer steps", True, finer),
        Attempt("from the high end down with finer steps", False, finer),
    ]


def _with_failures(attempt: Attempt, branch: Branch, others: list[tuple[Attempt, Branch]]) -> TerminationReason:
    """The termination of the branch that is returned, with the messages of the other attempts."""
    if not others:
        return branch.termination
    failures = "; ".join(f"{other.name}: {failed.termination.message}" for other, failed in others)
    return replace(branch.termination, message=f"{branch.termination.message}, {attempt.name}; {failures}")


def _in_rising_order(branch: Branch, termination: TerminationReason) -> Branch:
    """The branch from its end of lower frequency to the other one."""
    points = branch.points
    if not points or points[0].omega <= points[-1].omega:
        return branch._replace(termination=termination)
    return branch.reversed()._replace(termination=termination)


def _continue_from_end(continuation: Continuation, static: Array, upwards: bool, patience: _Patience) -> Branch:
    """The branch from one end of the range."""
    options = continuation.options
    omega, direction = options.omega_range[0 if upwards else 1], 1.0 if upwards else -1.0
    frequency_hz = options.frequency_hz[0 if upwards else 1]
    first = continuation.linear.start(omega, direction, options.step) if continuation.linear else None
    if first is None:
        start = periodic_start(continuation.balance, omega, static, options, continuation.contact)
        if not start.converged:
            error = f"relative residual {start.residual:.2g}"
            message = f"no start at {frequency_hz:.6g} Hz: no periodic solution found, {error}"
            return Branch([], [], [], TerminationReason("start failed", frequency_hz, message))
        first = continuation.solver.starting_point(start.solution, omega, direction, start.iterations)
    points = []
    for point in continuation.continue_branch(first, patience):
        points.append(point)
        if (motion := _motion(point)) > options.largest_motion:
            where = point.omega / (2.0 * np.pi)
            message = f"contact nodes move {motion:.3g} m apart at {where:.6g} Hz, further than the body is large "
            message += f"({options.largest_motion:.3g} m): nothing holds it there"
            return Branch(points, [], [], TerminationReason("too large", where, message))
    given_up = patience.is_gone or continuation.budget.is_spent
    return with_special_points(continuation, points, _termination(points, options, upwards, given_up))


def _motion(point: SolutionPoint) -> float:
    """Bound of the relative displacement of any contact node over a period, m."""
    return float(np.linalg.norm(np.abs(point.displacement).sum(axis=0), axis=-1).max())


def _termination(
    points: list[SolutionPoint], options: SolverOptions, upwards: bool, given_up: bool
) -> TerminationReason:
    """Why the branch from one end of the range ended."""
    low, high = options.frequency_hz
    last = points[-1].omega / (2.0 * np.pi)
    at_high, at_low = last >= high * (1.0 - 1e-12), len(points) > 1 and last <= low * (1.0 + 1e-12)
    if at_high if upwards else at_low:
        return TerminationReason("complete", last, f"complete: {low:g} to {high:g} Hz in {len(points)} points")
    if len(points) > 1 and (at_low or at_high):
        side, limit, proposal = ("low", low, "lower") if upwards else ("high", high, "higher")
        message = f"the curve turned back and left the range at its {side} end, {limit:g} Hz: start {proposal}"
        return TerminationReason("turned back", last, message)
    if len(points) >= options.most_points or given_up:
        message = f"given up at {last:.6g} Hz after {len(points)} points; a larger response.effort goes further"
        return TerminationReason("too many points", last, message)
    if any(points[-1].unknown is point.unknown for point in points[:-1]):
        message = f"the curve comes back to {last:.6g} Hz again and again: no way on was found"
        return TerminationReason("turned back", last, message)
    message = f"no next point found at {last:.6g} Hz with steps down to {options.min_step:g}"
    return TerminationReason("step too small", last, message)
