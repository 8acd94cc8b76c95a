"""Solutions carried from one problem to another: contact, force and structure change with a homotopy parameter s."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from functools import cached_property
from itertools import islice, pairwise

import numpy as np

from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.fourier import ComplexArray, to_complex, to_real
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.continuation.acceptance import passed_limit
from nonlinear.continuation.arclength_continuation import Continuation, ContinuationState
from nonlinear.continuation.corrector import BorderedSystem
from nonlinear.continuation.response_quantities import amplitude_derivative
from nonlinear.continuation.solution_point import SolutionPoint, Tangent
from nonlinear.continuation.step_control import ContinuationParameters, Step, follow
from nonlinear.harmonic_balance.residual import HarmonicBalance, InterferenceChange, LinearisedResidual, Parameter
from nonlinear.options import SolverOptions

DIFFERENCE = 1e-6  # of s, for dR/ds


@dataclass(frozen=True)
class Homotopy:
    """Balances R(x, omega; s) = (1 - s) defect between a first problem, s = 0, and a last one, s = 1.

    The contact parameters and the force are interpolated linearly. What else differs between the two problems (modes,
    friction law, harmonics) is that of the last one from the start: the first solution then leaves a residual, the
    defect, which is taken away in proportion (Newton homotopy).
    """

    last: HarmonicBalance  # the problem at s = 1
    contacts: tuple[ContactParameters, ContactParameters]  # parameters of the contact nodes at s = 0 and at s = 1
    forces: tuple[float, float]  # amplitudes of the excitation at s = 0 and at s = 1, N
    options: SolverOptions  # how the contact force is integrated
    defect: Array | None = None  # (n,), residual of the first solution at s = 0, m

    def balance(self, s: float) -> HarmonicBalance:
        """The balance at the homotopy parameter s."""
        force = (1.0 - s) * self.forces[0] + s * self.forces[1]
        receptance = self.last.receptance
        if force != receptance.force:
            receptance = replace(receptance, force=force)
        element = contact_element(interpolated(*self.contacts, s), self.last.n_harmonics, self.options)
        defect = None if self.defect is None or s == 1.0 else (1.0 - s) * self.defect
        return replace(self.last, receptance=receptance, element=element, defect=defect)

    @cached_property
    def interference_change(self) -> InterferenceChange | None:
        """How the balance changes with s; None where something else than the interference changes."""
        first, last = (replace(contact, interference=self.contacts[1].interference) for contact in self.contacts)
        if self.forces[0] != self.forces[1] or interpolated(first, last, 0.0) is not last:
            return None
        shift = np.asarray(self.contacts[1].interference - self.contacts[0].interference, dtype=float)
        return InterferenceChange(shift, np.zeros(self.last.size) if self.defect is None else -self.defect)

    def from_solution(self, unknown: Array, omega: float) -> Homotopy:
        """The homotopy of which a given (x, omega) is the solution at s = 0.

        Shapes: `unknown` (n,).
        """
        first = replace(self, defect=None).balance(0.0)
        residual = first.evaluate(unknown, omega).residual
        if first.relative_error(residual, unknown) <= self.options.tolerance:
            return replace(self, defect=None)
        return replace(self, defect=residual)


def interpolated(first: ContactParameters, last: ContactParameters, s: float) -> ContactParameters:
    """Contact parameters between two sets, linear in s; the friction law is that of the last one."""
    values = {}
    for item in fields(last):
        ends = getattr(first, item.name), getattr(last, item.name)
        if isinstance(ends[1], np.ndarray) and not np.array_equal(*ends):
            values[item.name] = (1.0 - s) * ends[0] + s * ends[1]
    return replace(last, **values) if values else last


@dataclass(frozen=True, kw_only=True)
class FixedFrequencyBalance(HarmonicBalance):
    """The balances of a homotopy at one frequency, over the parameter s."""

    homotopy: Homotopy  # the problems
    frequency: float  # excitation frequency, rad/s
    limits: tuple[float, float] = (0.0, 1.0)  # range of s

    @classmethod
    def of(
        cls, homotopy: Homotopy, frequency: float, limits: tuple[float, float] = (0.0, 1.0)
    ) -> FixedFrequencyBalance:
        """The balances of a homotopy at one frequency."""
        last = homotopy.last
        return cls(
            receptance=last.receptance,
            element=last.element,
            frozen_static=last.frozen_static,
            tiny=last.tiny,
            odd=last.odd,
            homotopy=homotopy,
            frequency=frequency,
            limits=limits,
        )

    @cached_property
    def parameter(self) -> Parameter:
        """The homotopy parameter: s = 1 is the last problem."""
        change = self.homotopy.interference_change
        name = "homotopy" if change is None else "interference"
        return Parameter(name, self.frequency, self.limits, change, origin=1.0)

    @property
    def is_modal_sum(self) -> bool:
        """The kernels know no other change than that of the interference."""
        return self.parameter.change is not None and super().is_modal_sum

    def shifted(self, unknown: Array, s: float) -> Array:
        """The displacement (2H+1, n_c, 3) that contacts with the last interference see, m.

        The contact force depends on d_n + v0 only, so that an interference is added to harmonic 0 of the normal
        displacement. Shapes: `unknown` (n,).
        """
        displacement = self.displacement(unknown).copy()
        if self.parameter.change is not None:
            displacement[0, :, 2] += (s - 1.0) * self.parameter.change.shift
        return displacement

    def evaluate(self, unknown: Array, s: float) -> LinearisedResidual:
        """Residual and derivatives at the parameter s.

        Shapes: `unknown` (n,).
        """
        change = self.parameter.change
        if change is None:
            linearised = self.homotopy.balance(s).evaluate(unknown, self.frequency)
            ahead = self.homotopy.balance(s + DIFFERENCE).evaluate(unknown, self.frequency)
            return replace(linearised, dR_dp=(ahead.residual - linearised.residual) / DIFFERENCE)
        contact = self.forces_of(self.shifted(unknown, s))
        rate = (contact.jacobian[:, :, 2, :, 0] * change.shift[:, None, None]).transpose(2, 0, 1)
        rows = rate.shape[0]
        forces = np.stack([contact.force.reshape(rows, -1), rate.reshape(rows, -1)], axis=-1)
        motion = to_real(self._matrix @ to_complex(forces))[self.first_row :]
        residual = unknown - self._linear - motion[..., 0].reshape(-1) - (s - 1.0) * change.defect_rate
        dR_ds = -motion[..., 1].reshape(-1) - change.defect_rate
        return LinearisedResidual(self, self.frequency, residual, dR_ds, contact)

    @cached_property
    def _matrix(self) -> ComplexArray:
        """The receptance, (H+1, 3 n_c, 3 n_c), m/N."""
        return self.receptance.matrix(self.frequency)

    @cached_property
    def _linear(self) -> Array:
        """Response without contact forces, (n,), m."""
        shape = len(self.receptance.harmonics), 3 * self.n_contacts
        response, _ = self.receptance.response(self.frequency, np.zeros(shape, dtype=complex))
        return to_real(response)[self.first_row :].reshape(-1)


STEPS_OF_PARAMETER = ContinuationParameters(frequency_scale=0.5)  # a range of s of 0.5 counts as unit arc length
MAX_MOVE = 0.5  # distance that a solution may move in one step of s, relative to the vibration
SMALLEST_INCREMENT = 1.0 / 64.0  # of s
SMALLEST_INCREMENT_OF_TOP = 1.0 / 256.0
MAX_CLIMB = 15  # points on the way to a top
MAX_POINTS = 80  # of a curve at fixed frequency


@dataclass(frozen=True)
class Carried:
    """Where a solution was carried to."""

    points: tuple[SolutionPoint, ...]  # solutions of the last problem; empty if none was reached
    # largest homotopy parameter reached, 1 where the last problem was reached. Below 1, the branch of the solution
    # ends there: it is the value at which the branch is born, on the way back
    lost_at: float


def carry_solution(
    homotopy: Homotopy, unknown: Array, omega: float, thorough: bool = True, fixed_frequency: bool = True
) -> Carried:
    """Carry a solution of the first problem to the last one.

    First with free frequency: each step of s predicts the solution by its rate of change with s, and solves for the
    nearest one in the plane normal to the curve over the frequency. Where this fails, the top of the branch is
    followed instead, as it is the last part of a shrinking isolated branch to go, or the curve over s at fixed
    frequency, which may turn back in folds.
    Shapes: `unknown` (n,).
    """
    continuation = _continuation(homotopy, 0.0)
    start = continuation.solver.point(unknown, omega)
    point, reached = _with_free_frequency(homotopy, start, 0.0, follow_top=False)
    if reached < 1.0 and thorough:
        point, reached = _with_free_frequency(homotopy, point, reached, follow_top=True)
    if reached >= 1.0:
        return Carried((point,), 1.0)
    if not fixed_frequency:
        return Carried((), reached)
    over_s = over_parameter(FixedFrequencyBalance.of(homotopy, omega), homotopy.options)
    last = Continuation(homotopy.balance(1.0), homotopy.options)
    for before, after in pairwise(continue_in_parameter(over_s, unknown, 0.0, 1.0, MAX_POINTS)):
        reached = max(reached, min(after.parameter, 1.0))
        found = solution_between(last, before, after, 1.0)
        if found is not None:
            return Carried((found,), 1.0)
    return Carried((), min(reached, 1.0))


def _continuation(homotopy: Homotopy, s: float) -> Continuation:
    """The continuation in the frequency at one value of s."""
    return Continuation(
        homotopy.balance(s), homotopy.options, parameters=ContinuationParameters(max_restart_distance=MAX_MOVE)
    )


def _with_free_frequency(
    homotopy: Homotopy, start: SolutionPoint, s: float, follow_top: bool
) -> tuple[SolutionPoint, float]:
    """The last solution of a natural continuation in s, and the s that it reached."""
    here, first = _continuation(homotopy, s), 0.125 if follow_top else 1.0 - s
    last = _Reached(homotopy, s, here, _top(here, start) if follow_top else start)

    def ahead(reached: _Reached, increment: float) -> Step[_Reached] | float:
        target = min(reached.s + increment, 1.0)
        there = _continuation(homotopy, target)
        found = there.solver.refit(_predicted(reached.point, reached.rate, target - reached.s))
        if found is None:
            return increment / 4.0
        point = _top(there, found) if follow_top else found
        return Step(_Reached(homotopy, target, there, point), increment, 2.0 * increment, target == 1.0)

    for step in follow(last, (ahead,), (first, SMALLEST_INCREMENT_OF_TOP if follow_top else SMALLEST_INCREMENT)):
        last = step.state
    return last.point, last.s


@dataclass(frozen=True)
class _Reached:
    """A solution of a homotopy."""

    homotopy: Homotopy
    s: float
    here: Continuation  # in the frequency at s
    point: SolutionPoint

    @cached_property
    def rate(self) -> Tangent:
        """dx/ds and domega/ds in the plane normal to the tangent of the curve over the frequency."""
        change = self.homotopy.interference_change
        rate = None if change is None else self.here.solver.interference_rate(self.point, change)
        if rate is not None:
            return rate
        balances = self.homotopy.balance(self.s), self.homotopy.balance(self.s + DIFFERENCE)
        return rate_of_change(*balances, DIFFERENCE, self.point)


def rate_of_change(first: HarmonicBalance, second: HarmonicBalance, step: float, point: SolutionPoint) -> Tangent:
    """dx/ds and domega/ds of a solution of `first` normal to its tangent; `second` holds at s + `step`."""
    linearised = first.evaluate(point.unknown, point.omega)
    shifted = second.evaluate(point.unknown, point.omega)
    system = BorderedSystem.factorise(linearised, point.metric.unit(point.tangent), point.metric)
    return system.newton_step((shifted.residual - linearised.residual) / step)


def _predicted(point: SolutionPoint, rate: Tangent, ds: float) -> SolutionPoint:
    """The point moved along its rate of change; the same point where its vibration would move too far.

    The static displacement may move by many times the vibration: with the interference, it does so linearly where the
    contacts stick.
    """
    dx, domega = ds * rate[0], ds * rate[1]
    vibration = point.balance.vibration(dx) / point.metric.length
    if not math.hypot(vibration, domega / point.metric.parameter) <= MAX_MOVE:  # nor with a NaN
        return point
    return replace(point, unknown=point.unknown + dx, parameter=point.omega + domega)


def _top(continuation: Continuation, start: SolutionPoint) -> SolutionPoint:
    """The highest of the points uphill of `start`, up to the next peak."""
    rising = amplitude_derivative(
        replace(start, contact=start.balance.forces(start.unknown)), continuation.options.output
    )
    direction = replace(start if rising > 0.0 else start.reversed(), step=continuation.options.step)
    top = start
    for point in islice(continuation.continue_branch(direction), MAX_CLIMB):
        if point.dA_ds < 0.0:
            break
        top = point
    return top


def over_parameter(
    balance: FixedFrequencyBalance, options: SolverOptions, parameters: ContinuationParameters = STEPS_OF_PARAMETER
) -> Continuation:
    """The continuation in the homotopy parameter at a fixed frequency."""
    return Continuation(balance, options, parameters=parameters)


def continue_in_parameter(
    continuation: Continuation,
    unknown: Array,
    s: float,
    direction: float,
    max_points: int,
    straight_end: Callable[[SolutionPoint], SolutionPoint | None] = lambda _: None,
) -> Iterator[SolutionPoint]:
    """Points (x, s) of the curve through a solution at the homotopy parameter `s`, folds in s included.

    It ends beyond a limit of s, after `max_points`, where no next point is found, and with what `straight_end` gives
    for a point from which on the curve is a straight line.
    Shapes: `unknown` (n,).
    """
    solver = continuation.solver
    start = solver.point(unknown, s, direction)

    def straight(state: ContinuationState, _: float) -> Step[ContinuationState] | None:
        end = straight_end(state.point)
        return None if end is None else state.step_to(end)._replace(last=True)

    for point in continuation.points(start, max_points, straight):
        yield point
        if passed_limit(point.parameter, solver.limits) is not None and point is not start:
            return


def solution_between(
    continuation: Continuation, before: SolutionPoint, after: SolutionPoint, s: float
) -> SolutionPoint | None:
    """The solution at the parameter `s`, whose continuation is given, between two points of a curve over s.

    None if it does not lie between them.
    """
    first, last = before.parameter - s, after.parameter - s
    if not first * last < 0.0:
        return None
    guess = before.unknown + first / (first - last) * (after.unknown - before.unknown)
    return continuation.solver.solution_at(before.omega, guess)
