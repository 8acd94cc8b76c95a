"""Prediction and correction of single points of a curve."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

from nonlinear.contact.parameters import Array
from nonlinear.continuation.corrector import (
    BorderedSystem,
    CompiledCorrector,
    Corrected,
    NormalPlane,
    compiled_corrector,
    correct,
)
from nonlinear.continuation.solution_point import Metric, SolutionPoint, Tangent
from nonlinear.continuation.step_control import ContinuationParameters, next_step
from nonlinear.harmonic_balance.initial_solution import solve_at
from nonlinear.harmonic_balance.newton_decisions import MAX_CORRECTIONS
from nonlinear.harmonic_balance.residual import HarmonicBalance, InterferenceChange
from nonlinear.options import SolverOptions, WorkBudget

SMALLEST_COSINE = 0.5  # of the angle between the last two tangents
LARGEST_EXTRAPOLATION = 3.0  # relative to the distance of the last two points
MOST_ITERATIONS = 15  # of damped Newton steps at one parameter
COMPILED = 3e-3  # work of an iteration of the compiled corrector for each unknown, millions of operations
FAILED = 5  # iterations of a step that is not found, about


def cubic_offset(previous: SolutionPoint, point: SolutionPoint, step: float, metric: Metric) -> Tangent | None:
    """Distance of the cubic Hermite extrapolation from the tangent, `step` beyond `point` and normal to the tangent.

    Let r be the distance of `previous` from the tangent line, at -L along it, and r' the derivative of r there. The
    offset is c2 s^2 + c3 s^3 with c2 = (r' L + 3 r) / L^2 and c3 = (r' L + 2 r) / L^3. None if the step is too long
    for an extrapolation or the tangents differ too much.
    """
    back = previous.unknown - point.unknown, previous.parameter - point.parameter
    length = -metric.product(back, point.tangent)
    if (
        length * LARGEST_EXTRAPOLATION < step
        or metric.product(metric.unit(previous.tangent), point.tangent) < SMALLEST_COSINE
    ):
        return None
    ratio = step / length
    weight_r, weight_dr = ratio**2 * (3.0 + 2.0 * ratio), ratio**2 * (1.0 + ratio) * length
    # r = back + L t and r' = t_previous / (t_previous . t) - t, so the offset is a sum of three known steps
    weight_previous = weight_dr / metric.product(previous.tangent, point.tangent)
    weight_tangent = weight_r * length - weight_dr
    displacement = weight_r * back[0] + weight_previous * previous.tangent[0] + weight_tangent * point.tangent[0]
    parameter = weight_r * back[1] + weight_previous * previous.tangent[1] + weight_tangent * point.tangent[1]
    return displacement, parameter


@dataclass(frozen=True)
class PredictorCorrector:
    """Solves the balance for points in the (x, p) space."""

    balance: HarmonicBalance  # the equations
    options: SolverOptions  # tolerances, frequency range and step lengths
    # largest deviations and scales
    parameters: ContinuationParameters = field(default_factory=ContinuationParameters)
    budget: WorkBudget = field(default_factory=WorkBudget)  # counts its iterations

    @property
    def limits(self) -> tuple[float, float]:
        """Range of the parameter: where nothing else is said, that of the frequency, rad/s."""
        return self.balance.parameter.limits or self.options.omega_range

    def metric(self, unknown: Array) -> Metric:
        """Scales at the unknown (n,)."""
        low, high = self.limits
        norm = math.sqrt(unknown @ unknown)
        length = max(self.balance.vibration(unknown), 1e-6 * norm, self.balance.tiny)
        return Metric(length, self.parameters.frequency_scale * (high - low))

    def starting_point(self, unknown: Array, omega: float, direction: float, iterations: int) -> SolutionPoint:
        """The solution (x, omega) as the start of a branch going up (`direction` +1) or down (-1) in frequency."""
        linearised = self.balance.evaluate(unknown, omega)
        dx_domega = linearised.solve(-linearised.dR_dp)
        return self.point(unknown, omega, (direction * dx_domega, direction), iterations)

    def point(
        self,
        unknown: Array,
        parameter: float,
        towards: Tangent | float = 1.0,
        iterations: int = 0,
        arc: float = 0.0,
        step: float | None = None,
    ) -> SolutionPoint:
        """The solution (x, p) as a point with its tangent on the side of `towards`, a direction or one of p alone."""
        towards = towards if isinstance(towards, tuple) else (0.0 * unknown, towards)
        linearised = self.balance.evaluate(unknown, parameter)
        metric = self.metric(unknown)
        tangent = BorderedSystem.factorise(linearised, metric.unit(towards), metric).tangent()
        solved = Corrected(unknown, parameter, linearised.contact, tangent, iterations)
        return self._with_tangent(solved, towards, 0, arc, self.options.step if step is None else step)

    def solution_at(
        self,
        parameter: float,
        guess: Array,
        towards: Tangent | float = 1.0,
        most_iterations: int = MOST_ITERATIONS,
        arc: float = 0.0,
        step: float | None = None,
    ) -> SolutionPoint | None:
        """The solution at a parameter near a guess (n,) as a point (see `point`), by damped Newton steps."""
        found = solve_at(self.balance, parameter, guess, self.options, most_iterations)
        self.budget.spend((found.iterations + 1) * self._iteration_work)
        if not found.converged:
            return None
        return self.point(found.solution, parameter, towards, found.iterations, arc, step)

    def _with_tangent(
        self, solved: Corrected, towards: Tangent, bordered_sign: int, arc: float, step: float
    ) -> SolutionPoint:
        """The point with its tangent on the side of `towards`.

        At a kink, where the tangent changes by a large angle, the `bordered_sign` of the curve decides on the side.
        It is 0 where it is not known.
        """
        metric = self.metric(solved.unknown)
        tangent, sign, jacobian_sign = solved.tangent
        tangent = metric.unit(tangent)
        if (
            bordered_sign not in (0, sign)
            and metric.product(metric.unit(towards), tangent) < self.parameters.min_cosine
        ):
            tangent, sign = (-tangent[0], -tangent[1]), -sign
        return SolutionPoint(
            balance=self.balance,
            unknown=solved.unknown,
            parameter=solved.parameter,
            tangent=tangent,
            metric=metric,
            contact=solved.contact,
            jacobian_sign=jacobian_sign,
            bordered_sign=sign,
            iterations=solved.iterations,
            arc=arc,
            step=step,
        )

    def step(
        self,
        point: SolutionPoint,
        step: float,
        direction: Tangent | None = None,
        previous: SolutionPoint | None = None,
        refactorise: bool = False,
    ) -> SolutionPoint | None:
        """The point at arc length `step` beyond `point`; None if the corrector fails."""
        normal = direction or point.tangent
        metric = point.metric
        max_distance = step * self._largest_relative_deviation(step)
        predicted = point.unknown + step * normal[0], point.parameter + step * normal[1]
        plane = NormalPlane(*predicted, normal, metric, max_distance)
        offset = None
        if previous is not None and direction is None:
            offset = cubic_offset(previous, point, step, metric)
            if offset is not None and metric.norm(*offset) > 0.5 * max_distance:
                offset = None
        solved = self._correct(plane, offset, refactorise)
        if solved is None:
            return None
        deviation = plane.distance(solved.unknown, solved.parameter)
        following = next_step(step, deviation, solved.iterations, self.options, self.parameters)
        return self._with_tangent(solved, normal, point.bordered_sign, point.arc + step, following)

    def _correct(
        self, plane: NormalPlane, offset: Tangent | None = None, refactorise: bool = False
    ) -> Corrected | None:
        """The solution in the plane: by the compiled corrector, if the problem is small."""
        if self._compiled is not None:
            found = self._compiled.correct(plane, offset, refactorise)
        else:
            found = correct(self.balance, self.options, plane, offset, refactorise)
        self.budget.spend((FAILED if found is None else found.iterations + 1) * self._iteration_work)
        return found

    def interference_rate(self, point: SolutionPoint, change: InterferenceChange) -> Tangent | None:
        """Change of a solution (x, p) in the plane normal to its tangent with another parameter, of the interference.

        None where the problem is not small.
        """
        if self._compiled is None:
            return None
        normal = point.metric.unit(point.tangent)
        return self._compiled.rate(NormalPlane(point.unknown, point.parameter, normal, point.metric, 0.0), change)

    @cached_property
    def _iteration_work(self) -> float:
        compiled = self._compiled is not None
        return COMPILED * self.balance.size if compiled else self.balance.iteration_work

    @cached_property
    def _compiled(self) -> CompiledCorrector | None:
        return compiled_corrector(self.balance, self.options)

    def _largest_relative_deviation(self, step: float) -> float:
        crosses_kink = step <= self.parameters.kink_step
        return self.parameters.max_kink_deviation if crosses_kink else self.parameters.max_deviation

    def refit(self, point: SolutionPoint) -> SolutionPoint | None:
        """The solution with the harmonics of this balance nearest to `point`, in the plane normal to its tangent.

        `point` may have another number of harmonics. None if the corrector fails.
        """
        start = point.with_balance(self.balance)
        metric = self.metric(start.unknown)
        normal = metric.unit(start.tangent)
        plane = NormalPlane(start.unknown, start.parameter, normal, metric, self.parameters.max_restart_distance)
        solved = self._correct(plane)
        if solved is None:
            return None
        return self._with_tangent(solved, normal, 0, point.arc, point.step)

    def at_parameter(self, point: SolutionPoint, parameter: float) -> SolutionPoint | None:
        """The point of the curve near `point` at a parameter, predicted by the tangent; None if not found."""
        step = (parameter - point.parameter) / point.tangent[1]
        guess = point.unknown + step * point.tangent[0]
        arc = point.arc + abs(step)
        return self.solution_at(parameter, guess, point.tangent, MAX_CORRECTIONS, arc, point.step)
