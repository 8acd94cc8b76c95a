"""Pseudo-arc-length continuation of the solutions of R(x, p) = 0: the loop over accepted steps."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
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
from nonlinear.continuation.step_control import ContinuationParameters, Resonances, next_step, step_to_resonance
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.options import SolverOptions

Progress = Callable[[float, int], None]  # frequency in Hz, number of points


class ContinuationState(NamedTuple):
    """What a step starts from."""

    point: SolutionPoint  # last point
    previous: SolutionPoint | None = None  # the point before, if it has the same harmonics
    branch_points: tuple[SolutionPoint, ...] = ()  # branch points crossed so far

    def after(self, step: AcceptedStep, adapted: SolutionPoint | None = None) -> ContinuationState:
        """The state after a step, whose point may have been `adapted` to another number of harmonics."""
        point = adapted or step.point
        previous = self.point if point.balance is self.point.balance else None
        crossed = () if step.branch_point is None else (step.branch_point,)
        return ContinuationState(point, previous, self.branch_points + crossed)


class AcceptedStep(NamedTuple):
    """The next point, and the branch point crossed on the way to it, if any."""

    point: SolutionPoint
    branch_point: SolutionPoint | None = None


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

    @cached_property
    def solver(self) -> PredictorCorrector:
        """Predictor and corrector."""
        return PredictorCorrector(self.balance, self.options, self.parameters)

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
        `start` (which is then its last point too), where no next point is found, or after `max_points`.
        """
        current = self.with_balance(start.balance)
        first = start if self.adapt is None else self.adapt(current, start)
        yield self.recorder.record(first or start)
        if first is None:
            return
        state, current = ContinuationState(first), current.with_balance(first.balance)
        for count in range(1, self.options.max_points):
            step = current.next_point(state)
            if step is None:
                return
            point, found = state.point, step.point
            if count > 2 and passes_through(current.solver, point, found, first):
                arc = point.arc + distance_along_tangent(point, first)
                yield self.recorder.record(first.changed(arc=arc))
                return
            limit = passed_limit(found.parameter, current.solver.limits)
            if limit is not None:
                end = found if found.parameter == limit else current.solver.at_parameter(point, limit)
                yield self.recorder.record(found if end is None else end)
                return
            adapted = found if current.adapt is None else current.adapt(current, found)
            if adapted is None:
                return
            state = state.after(step, adapted)
            current = current.with_balance(adapted.balance)
            if progress is not None:
                progress(adapted.omega / (2.0 * np.pi), count)
            yield self.recorder.record(adapted)

    def next_point(self, state: ContinuationState) -> AcceptedStep | None:
        """The next accepted point; None if no way to it succeeds.

        In this order: along a linear segment, along the tangent with shorter and shorter steps, along the secant, and
        across a kink.
        """
        found = self._linear_step(state.point)
        if found is not None:
            return AcceptedStep(found)
        step = self._tangent_step(state)
        if step is not None:
            return step
        found = self._secant_step(state) or point_beyond_kink(self.solver, state.point)
        return None if found is None else AcceptedStep(found)

    def _linear_step(self, point: SolutionPoint) -> SolutionPoint | None:
        """The next point on a linear segment; None off such a segment, and at its end."""
        if self.linear is None or point.tangent[1] == 0.0:
            return None
        low, high = self.options.omega_range
        wanted = min(point.step, self.options.max_step)
        step = self._up_to_resonance(point, wanted, self.resonances.natural)
        limit = high if point.tangent[1] > 0.0 else low
        step = min(step, max((limit - point.omega) / point.tangent[1], self.options.min_step))
        while step >= self.options.min_step:
            found = self.linear.step(point, step)
            if found is None:
                return None
            predicted = point.unknown + step * point.tangent[0], point.omega + step * point.tangent[1]
            deviation = point.metric.norm(found.unknown - predicted[0], found.omega - predicted[1])
            if found.step < step or deviation <= self.parameters.max_deviation * step:
                following = next_step(step, deviation, 0, self.options, self.parameters)
                return found.changed(step=wanted if step < wanted and following >= step else following)
            step /= 2.0
        return None

    def _tangent_step(self, state: ContinuationState) -> AcceptedStep | None:
        """The next point along the tangent, which continues the curve or lies beyond a branch point of it."""
        point = state.point
        wanted = min(point.step, self.options.max_step)
        step = self._up_to_resonance(point, wanted, self.resonances.all)
        while step >= self.options.min_step:
            found = self.solver.step(point, step, previous=state.previous)
            if found is not None:
                follows = follows_curve(point, found, self.parameters)
                branch_point = None
                if not follows:
                    crossed = state.branch_points
                    branch_point = find_crossed_branch_point(self.solver, point, found, step, crossed)
                if follows or branch_point is not None:
                    # a step cut short at a resonance is no reason for a short next step
                    keeps_length = step < wanted and found.step >= step
                    return AcceptedStep(found.changed(step=wanted) if keeps_length else found, branch_point)
            wanted = step = step / (3.0 if found is None else 2.0)
        return None

    def _secant_step(self, state: ContinuationState) -> SolutionPoint | None:
        """The next point along the secant through the last two points."""
        point, previous = state.point, state.previous
        if previous is None:
            return None
        secant = point.metric.unit((point.unknown - previous.unknown, point.parameter - previous.parameter))
        for step in np.geomspace(self.options.max_step, self.options.min_step, 24):
            found = self.solver.step(point, float(step), secant)
            if found is not None and found.bordered_sign == point.bordered_sign:
                return found.changed(step=self.options.step)
        return None

    def _up_to_resonance(self, point: SolutionPoint, step: float, resonances: tuple[float, ...]) -> float:
        """The step, cut short at the next resonance."""
        return step_to_resonance(point, step, resonances, self.options.min_step, self.parameters.resonance_tolerance)
