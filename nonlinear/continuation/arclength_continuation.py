"""Pseudo-arc-length continuation of R(x, p) = 0: where a branch ends, and the ways to its next point."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from nonlinear.contact.parameters import ContactParameters
from nonlinear.continuation.acceptance import (
    distance_along_tangent,
    find_crossed_branch_point,
    follows_curve,
    passed_limit,
    passes_through,
    point_beyond_kink,
)
from nonlinear.continuation.linear_segments import LinearSegments, LinearSegmentSteps
from nonlinear.continuation.point_stability import PointRecorder, PointStability
from nonlinear.continuation.predictor_corrector import PredictorCorrector
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.continuation.step_control import (
    ContinuationParameters,
    Resonances,
    Step,
    Way,
    follow,
    next_step,
    step_to_resonance,
)
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.options import SolverOptions, WorkBudget

Progress = Callable[[float, int], bool | None]  # frequency in Hz, number of points; True: the branch is given up


@dataclass(frozen=True)
class Continuation:
    """Continuation of the solutions of a balance in its parameter, for most the frequency."""

    balance: HarmonicBalance  # the equations
    options: SolverOptions  # frequency range, step lengths and tolerances
    # frequencies that no step may pass without a point there: a resonance may be narrower than a step
    resonances: Resonances = field(default_factory=Resonances)
    # with it, linear segments, on which no contact changes its state, are followed without iterations
    contact: ContactParameters | None = None
    # gives each new point the number of harmonics that it needs; see `HarmonicSelection`
    adapt: Callable[[Continuation, SolutionPoint], SolutionPoint | None] | None = None
    stability: PointStability | None = None  # computes the Floquet exponents of each point
    # thresholds of step control and acceptance
    parameters: ContinuationParameters = field(default_factory=ContinuationParameters)
    budget: WorkBudget = field(default_factory=WorkBudget)  # of all branches continued with it

    @cached_property
    def solver(self) -> PredictorCorrector:
        """Predictor and corrector."""
        return PredictorCorrector(self.balance, self.options, self.parameters, self.budget)

    @cached_property
    def linear(self) -> LinearSegmentSteps | None:
        """Steps along linear segments."""
        if self.contact is None or self.balance.defect is not None:
            return None
        return LinearSegmentSteps(LinearSegments(self.balance, self.contact), self.solver.metric, self.options.output)

    @cached_property
    def recorder(self) -> PointRecorder:
        """Adds derived quantities to points."""
        return PointRecorder(self.options.output, self.stability)

    def with_balance(self, balance: HarmonicBalance) -> Continuation:
        """The same continuation of another balance of the problem."""
        return self if balance is self.balance else replace(self, balance=balance)

    def is_linear(self, point: SolutionPoint) -> bool:
        """Whether the point is known to lie on a linear segment."""
        if point.linear is not None:
            return True
        return self.linear is not None and self.linear.segments.state(point.displacement) is not None

    def continue_branch(self, start: SolutionPoint, progress: Progress | None = None) -> Iterator[SolutionPoint]:
        """Points of the branch from `start` on, in the direction of its tangent.

        The branch ends where it leaves the frequency range (its last point lies on the limit), where it comes back to
        one of its points (which is then its last point too; `start` of a closed one), where no next point is found,
        where `progress` returns True, after `most_points`, or with the budget.
        """
        current = self.with_balance(start.balance)
        first = start if self.adapt is None else self.adapt(current, start)
        yield self.recorder.record(first or start)
        if first is None:
            return
        state = ContinuationState(current.with_balance(first.balance), first)
        lengths, most = (first.step, self.options.min_step), self.options.most_points - 1
        for count, step in enumerate(follow(state, WAYS, lengths, most, partial(_arrived, PointsPassed(first))), 1):
            given_up = progress is not None and progress(step.state.point.omega / (2.0 * np.pi), count)
            yield self.recorder.record(step.state.point)
            if given_up or self.budget.is_spent:
                return

    def points(self, start: SolutionPoint, most: int, *ways: Way[ContinuationState]) -> Iterator[SolutionPoint]:
        """`start` and up to `most` points after it: the bare curve, whatever its range. `ways`: to be tried first."""
        yield start
        lengths = start.step, self.options.min_step
        for step in follow(ContinuationState(self, start), (*ways, *WAYS), lengths, most):
            yield step.state.point
            if self.budget.is_spent:
                return

    def up_to_resonance(self, point: SolutionPoint, step: float, resonances: tuple[float, ...]) -> float:
        """The step, cut short at the next resonance."""
        return step_to_resonance(point, step, resonances, self.options.min_step, self.parameters.resonance_tolerance)


class ContinuationState(NamedTuple):
    """What a step starts from."""

    continuation: Continuation  # of the balance of the point
    point: SolutionPoint  # last point
    previous: SolutionPoint | None = None  # the point before, if it has the same harmonics
    branch_points: tuple[SolutionPoint, ...] = ()  # branch points crossed so far

    def step_to(self, found: SolutionPoint, *branch_points: SolutionPoint) -> Step[ContinuationState]:
        """The step to a point, across a branch point if one is given."""
        reached = ContinuationState(self.continuation, found, self.point, self.branch_points + branch_points)
        return Step(reached, found.arc - self.point.arc, found.step)


MOST_LAPS = 3  # times that a branch may come back to points but its first; the first times it may leave elsewhere


@dataclass
class PointsPassed:
    """Points of a branch that it may come back to: the first, and one of ever more steps before (Brent 1980).

    A branch that runs into a loop beyond its start would go round it without end.
    """

    first: SolutionPoint
    latest: SolutionPoint = field(init=False)
    steps: int = 0
    laps: int = 0  # times that the branch came back to the latest

    def __post_init__(self) -> None:
        """None but the first."""
        self.latest = self.first

    def met(self, solver: PredictorCorrector, point: SolutionPoint, found: SolutionPoint) -> SolutionPoint | None:
        """That of them at which the branch ends between two points, if any."""
        if passes_through(solver, point, found, self.first):
            return self.first
        if self.latest is not self.first and passes_through(solver, point, found, self.latest):
            self.laps += 1
            if self.laps == MOST_LAPS:
                return self.latest
        self.steps += 1
        if self.steps & (self.steps - 1) == 0:
            self.latest = found
        return None


def _arrived(
    passed: PointsPassed, before: ContinuationState, step: Step[ContinuationState]
) -> Step[ContinuationState] | None:
    """The step, ended at a point passed before or at a limit, or with the harmonics that it needs."""
    state, point, found = step.state, before.point, step.state.point
    continuation = state.continuation
    met = passed.met(continuation.solver, point, found)
    if met is not None:
        end = met.changed(arc=point.arc + distance_along_tangent(point, met))
        return step._replace(state=state._replace(point=end), last=True)
    limit = passed_limit(found.parameter, continuation.solver.limits)
    if limit is not None:
        at_limit = found if found.parameter == limit else continuation.solver.at_parameter(point, limit)
        return step._replace(state=state._replace(point=at_limit or found), last=True)
    adapted = found if continuation.adapt is None else continuation.adapt(continuation, found)
    if adapted is None or adapted is found:
        return step if adapted else None
    previous = point if adapted.balance is point.balance else None
    current = continuation.with_balance(adapted.balance)
    reached = ContinuationState(current, adapted, previous, state.branch_points)
    return step._replace(state=reached, following=adapted.step)


def _linear_step(state: ContinuationState, length: float) -> Step[ContinuationState] | float | None:
    """The next point on a linear segment; None off such a segment, and at its end."""
    continuation, point, linear = state.continuation, state.point, state.continuation.linear
    if linear is None or point.tangent[1] == 0.0:
        return None
    options, parameters = continuation.options, continuation.parameters
    low, high = options.omega_range
    wanted = min(point.step, options.max_step)
    step = continuation.up_to_resonance(point, min(length, wanted), continuation.resonances.natural)
    limit = high if point.tangent[1] > 0.0 else low
    step = min(step, max((limit - point.omega) / point.tangent[1], options.min_step))
    found = linear.step(point, step)
    if found is None:
        return None
    predicted = point.unknown + step * point.tangent[0], point.omega + step * point.tangent[1]
    deviation = point.metric.norm(found.unknown - predicted[0], found.omega - predicted[1])
    if found.step >= step and deviation > parameters.max_deviation * step:
        return step / 2.0
    following = next_step(step, deviation, 0, options, parameters)
    return state.step_to(found.changed(step=wanted if step < wanted and following >= step else following))


def _tangent_step(state: ContinuationState, length: float) -> Step[ContinuationState] | float:
    """The next point along the tangent, which continues the curve or lies beyond a branch point of it."""
    continuation, point = state.continuation, state.point
    wanted = min(length, continuation.options.max_step)
    step = continuation.up_to_resonance(point, wanted, continuation.resonances.all)
    found = continuation.solver.step(point, step, previous=state.previous)
    if found is None:
        return step / 3.0
    # a step cut short at a resonance is no reason for a short next step
    following = found.changed(step=wanted) if step < wanted and found.step >= step else found
    if follows_curve(point, found, continuation.parameters):
        return state.step_to(following)
    crossed = find_crossed_branch_point(continuation.solver, point, found, step, state.branch_points)
    return step / 2.0 if crossed is None else state.step_to(following, crossed)


def _secant_step(state: ContinuationState, _: float) -> Step[ContinuationState] | None:
    """The next point along the secant through the last two points, whatever the lengths tried before."""
    point, previous, options = state.point, state.previous, state.continuation.options
    if previous is None:
        return None
    secant = point.metric.unit((point.unknown - previous.unknown, point.parameter - previous.parameter))
    for step in np.geomspace(options.max_step, options.min_step, 24):
        found = state.continuation.solver.step(point, float(step), secant)
        if found is not None and found.bordered_sign == point.bordered_sign:
            return state.step_to(found.changed(step=options.step))
    return None


def _step_beyond_kink(state: ContinuationState, _: float) -> Step[ContinuationState] | None:
    """The next point across a kink."""
    found = point_beyond_kink(state.continuation.solver, state.point)
    return None if found is None else state.step_to(found)


WAYS = (_linear_step, _tangent_step, _secant_step, _step_beyond_kink)
