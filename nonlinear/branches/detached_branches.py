"""Search for isolated branches (isolas), which no continuation of the main branch reaches.

An isolated branch (isola) is a closed curve. A branch that is not known to close is called a detached branch: it may
leave the frequency range, and be connected with the main branch outside of it.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain, pairwise
from typing import NamedTuple

import numpy as np

from nonlinear.branches.branch import Branch
from nonlinear.branches.branch_collection import BranchCollection, FoundBranch, KnownBranch, Lifting, lift_branch
from nonlinear.branches.parameter_continuation import (
    FixedFrequencyBalance,
    Homotopy,
    continue_in_parameter,
    over_parameter,
    solution_between,
)
from nonlinear.branches.range_continuation import continue_over_range
from nonlinear.contact.parameters import Array
from nonlinear.continuation.arclength_continuation import Continuation, Progress
from nonlinear.continuation.corrector import nearest_solution
from nonlinear.continuation.linear_segments import LinearSegments
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.continuation.step_control import ContinuationParameters
from nonlinear.harmonic_balance.initial_solution import TruncatedBalances
from nonlinear.nonlinear_modes.resonance_motions import resonance_motions

FEW_HARMONICS = (1, 3)  # numbers of harmonics with which all branches are traced first
MOST_POINTS = 1500  # of a main branch with few harmonics
# steps along branches with few harmonics, which only lead to others; see ContinuationParameters
MAX_STEP, TARGET_DEVIATION = 0.5, 0.2
SPREAD = 3  # frequencies evenly over the range at which there is a curve over the interference
AMONG_FOLDS = 4  # the same between the lowest and the highest fold of the branches with fewer harmonics
MOST_OVER_INTERFERENCE = 60  # points of such a curve, in each direction
RANGE = 2.0  # of the interference on both sides, in largest normal displacements of the main branch
# these curves only have to lead to starting points, which are solved to the tolerance asked for
STEPS = ContinuationParameters(frequency_scale=0.25, target_deviation=0.3, largest_factor=4.0, kink_step=0.05)
TOLERANCE, ROUND_OFF = 1e-5, 1e-9  # relative residuals
ASKED_FOR, LOW, HIGH = 1.0, 0.0, 2.0  # the parameter at the interference asked for, and at the ends of the range


class BranchSearch(NamedTuple):
    """What a search found."""

    branches: list[FoundBranch]  # detached branches by falling highest amplitude
    # solutions on further branches that were not followed, as there were too many branches; -1: not finished
    left_out: int


def detached_branches(
    continuation: Continuation,
    lifting: Lifting,
    known: list[Branch],
    static: Array,
    progress: Progress | None = None,
) -> BranchSearch:
    """Isolated and detached branches.

    All branches are traced with 1 and with 3 harmonics first, and lifted from several points of each to the next
    number of harmonics, at last to all of them: what then lies on no known branch is a new one. It is continued in
    both directions until it closes or leaves the range. With few harmonics, branches start from
    * linear responses, with all contacts open and with all contacts stuck, at both ends of the range and at every
      natural frequency in it, which Newton's method takes to a solution;
    * the resonances of the nonlinear modes with one harmonic;
    * solutions met a second time on the curve over the interference at fixed frequency, see
      `solutions_over_interference`.
    The search is no proof: a branch that none of these starting points leads to is not found.
    Shapes: `static` (n_c, 3).
    """
    traced = [branch for branch in known if branch.points]
    if not traced:
        return BranchSearch([], 0)
    most = lifting.numbers[-1]
    full = BranchCollection(
        continuation.with_balance(lifting.balances.balance(most)),
        [KnownBranch.of(branch.points) for branch in traced],
        progress=progress,
    )
    coarser: list[tuple[list[SolutionPoint], str]] = []
    few = few_harmonics(lifting.balances)
    for number in [n for n in few if n < most]:
        coarser = _with_few_harmonics(continuation, lifting, number, static, coarser)
    if most <= few[-1]:
        folds = _folds(points for points, _ in coarser)
        for point, origin in _starting_points(full.continuation, traced[0].points, folds, static):
            full.offer(point, origin)
    for points, origin in coarser:
        lift_branch(full, lifting, points, origin)
    left_out = -1 if continuation.budget.is_spent else full.left_out
    return BranchSearch(sorted(full.found, key=lambda found: -found.height), left_out)


def few_harmonics(balances: TruncatedBalances) -> tuple[int, ...]:
    """`FEW_HARMONICS`, but none below the highest harmonic of the excitation."""
    return tuple(sorted({max(n, balances.highest_excited) for n in FEW_HARMONICS}))


def _with_few_harmonics(
    continuation: Continuation,
    lifting: Lifting,
    number: int,
    static: Array,
    coarser: list[tuple[list[SolutionPoint], str]],
) -> list[tuple[list[SolutionPoint], str]]:
    """All branches with a small number of harmonics, the main one first, and how they were found."""
    balance = lifting.balances.balance(number)
    options = replace(continuation.options, max_points=MOST_POINTS, max_step=MAX_STEP)
    coarse = replace(continuation.parameters, target_deviation=TARGET_DEVIATION)
    few = replace(continuation.with_balance(balance), options=options, parameters=coarse, stability=None, adapt=None)
    origin = "the main branch with " + ("one harmonic" if number == 1 else f"{number} harmonics")
    main = [branch.points for branch in continue_over_range(few, static) if branch.points]
    if not main:
        return coarser
    folds = _folds(points for points, _ in coarser)
    collection = BranchCollection(few, [KnownBranch.of(points) for points in main], final=False)
    for point, found_by in _starting_points(few, main[0], folds, static):
        collection.offer(point, found_by)
    for points, found_by in coarser:
        lift_branch(collection, replace(lifting, numbers=(number,)), points, found_by)
    return [*((points, origin) for points in main), *((item.branch.points, item.origin) for item in collection.found)]


def _folds(branches: Iterable[list[SolutionPoint]]) -> list[float]:
    """Frequencies of the folds of branches, rad/s."""
    return [
        point.omega
        for points in branches
        for before, point in pairwise(points)
        if before.tangent[1] * point.tangent[1] < 0.0
    ]


def _starting_points(
    continuation: Continuation, main: list[SolutionPoint], folds: list[float], static: Array
) -> Iterator[tuple[SolutionPoint, str]]:
    """Solutions, and how they were found, as long as there is work left."""
    every = [_from_linear_responses(continuation), solutions_over_interference(continuation, main, folds)]
    if continuation.balance.n_harmonics == FEW_HARMONICS[0]:
        every.insert(1, _from_nonlinear_modes(continuation, static))
    for point in chain.from_iterable(every):
        if continuation.budget.is_spent:
            return
        yield point


def _from_linear_responses(continuation: Continuation) -> Iterator[tuple[SolutionPoint, str]]:
    """The solutions that Newton's method reaches from linear responses."""
    if continuation.linear is None:
        return
    balance, options = continuation.balance, continuation.options
    for omega in (*options.omega_range, *continuation.resonances.natural):
        for system, state in zip(continuation.linear.segments.uniform(), ("open", "stuck"), strict=True):
            guess = balance.unknown(system.motion(omega).displacement)
            point = continuation.solver.solution_at(omega, guess)
            if point is not None:
                yield point, f"the linear response with all contacts {state}"


def _from_nonlinear_modes(continuation: Continuation, static: Array) -> Iterator[tuple[SolutionPoint, str]]:
    """The solutions nearest to the resonances of the nonlinear modes."""
    contact, balance, options = continuation.contact, continuation.balance, continuation.options
    if contact is None:
        return
    for unknown, omega, number in resonance_motions(balance, contact, static, options.omega_range):
        found = nearest_solution(balance, unknown, omega, continuation.solver.metric(unknown))
        if found is not None and options.omega_range[0] <= found[1] <= options.omega_range[1]:
            yield continuation.solver.point(*found), f"a resonance of nonlinear mode {number}"


def solutions_over_interference(
    continuation: Continuation, main: list[SolutionPoint], folds: Sequence[float] = ()
) -> Iterator[tuple[SolutionPoint, str]]:
    """Solutions on curves over the interference through points of the main branch, and how they were found.

    At one frequency the solutions of all interferences form a curve from the stuck response (a large interference) to
    the free one (a wide gap). Where it turns back and passes the interference asked for again, there are more
    solutions than that of the main branch: also those of isolated branches. Force and interference scaled together
    scale the response, so that the curve over the force tells nothing new.
    """
    contact = continuation.contact
    if contact is None or contact.odd:
        return
    options = replace(continuation.options, tolerance=TOLERANCE, round_off=ROUND_OFF, max_step=MAX_STEP)
    unit = RANGE * max(_normal_motion(point) for point in main)
    below = contact.with_interference(contact.interference - unit)
    force = continuation.balance.receptance.force
    homotopy = Homotopy(continuation.balance, (below, contact), (force, force), options)
    segments = None if continuation.linear is None else continuation.linear.segments
    omega = np.array([point.omega for point in main])
    spread = np.linspace(*continuation.options.omega_range, SPREAD + 2)[1:-1]
    among = np.linspace(min(folds), max(folds), AMONG_FOLDS + 2)[1:-1] if len(folds) else ()
    for place in dict.fromkeys(int(np.argmin(np.abs(omega - wanted))) for wanted in (*among, *spread)):
        start = main[place]
        balance = FixedFrequencyBalance.of(homotopy, start.omega, (LOW, HIGH))
        over = replace(over_parameter(balance, options, STEPS), budget=continuation.budget)
        end = partial(straight_end, balance, segments)
        origin = f"the curve over the interference at {start.omega / (2.0 * np.pi):.4g} Hz"
        for direction in (1.0, -1.0):
            points = continue_in_parameter(over, start.unknown, ASKED_FOR, direction, MOST_OVER_INTERFERENCE, end)
            for before, after in pairwise(points):
                found = solution_between(continuation, before, after, ASKED_FOR)
                if found is not None:
                    yield found, origin


def _normal_motion(point: SolutionPoint) -> float:
    """Bound of the normal vibration of the contacts, m."""
    rows = point.displacement[1:, :, 2]
    return float(np.hypot(rows[::2], rows[1::2]).sum(axis=0).max())


def straight_end(
    balance: FixedFrequencyBalance, segments: LinearSegments | None, point: SolutionPoint
) -> SolutionPoint | None:
    """The end of the range, where no contact changes its state and no slider leaves its place on the way; else None.

    The motions of one linear state are a convex set: if both ends of a straight line belong to it, the line does.
    """
    if segments is None or point.tangent[1] == 0.0:
        return None
    start = balance.shifted(point.unknown, point.parameter)
    state = segments.state(start)
    if state is None:
        return None
    limit = HIGH if point.tangent[1] > 0.0 else LOW
    unknown = point.unknown + (limit - point.parameter) / point.tangent[1] * point.tangent[0]
    end = balance.shifted(unknown, limit)
    last = segments.state(end)
    if last is None or not np.array_equal(last.pressed, state.pressed):
        return None
    system = segments.system(state)
    if system.moved_in_cone(start).any() or not np.array_equal(system.moved(start), system.moved(end)):
        return None
    return replace(point, unknown=unknown, parameter=limit)
