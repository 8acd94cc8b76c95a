"""Solutions carried from one problem to another: contact, force and structure change with a homotopy parameter s."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from functools import cached_property
from itertools import islice, pairwise

import numpy as np

from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.continuation.arclength_continuation import Continuation, ContinuationState
from nonlinear.continuation.corrector import BorderedSystem
from nonlinear.continuation.response_quantities import amplitude_derivative
from nonlinear.continuation.solution_point import SolutionPoint, Tangent
from nonlinear.continuation.step_control import ContinuationParameters
from nonlinear.harmonic_balance.initial_solution import solve_at
from nonlinear.harmonic_balance.residual import (
    HarmonicBalance,
    InterferenceChange,
    InterferencePath,
    LinearisedResidual,
)
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

    def from_solution(self, unknown: Array, omega: float) -> "Homotopy":
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
    """The balance at one frequency with the homotopy parameter in the place of the frequency.

    The continuation in the frequency becomes one in the parameter. Its `omega` is 1 + s.
    """

    homotopy: Homotopy  # the problems
    frequency: float  # excitation frequency, rad/s

    @classmethod
    def of(cls, homotopy: Homotopy, frequency: float) -> "FixedFrequencyBalance":
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
        )

    @cached_property
    def interference_path(self) -> InterferencePath | None:
        """The interference in the place of the frequency, where nothing else changes with s."""
        change = self.homotopy.interference_change
        return None if change is None else InterferencePath(change, self.frequency, 2.0)

    def evaluate(self, unknown: Array, omega: float) -> LinearisedResidual:
        """Residual and derivatives; `dR_domega` is the derivative with respect to the homotopy parameter.

        Shapes: `unknown` (n,).
        """
        s = omega - 1.0
        linearised = self.homotopy.balance(s).evaluate(unknown, self.frequency)
        shifted = self.homotopy.balance(s + DIFFERENCE).evaluate(unknown, self.frequency)
        return replace(linearised, dR_domega=(shifted.residual - linearised.residual) / DIFFERENCE)


PARAMETER_SCALE = 0.5  # range of s that counts as unit arc length
MAX_MOVE = 0.5  # distance that a solution may move in one step of s, relative to the vibration
SMALLEST_INCREMENT = 1.0 / 64.0  # of s
SMALLEST_INCREMENT_OF_TOP = 1.0 / 256.0
MAX_CLIMB = 15  # points on the way to a top
MAX_POINTS = 80  # of a curve at fixed frequency
MAX_ITERATIONS = 15


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
    start = continuation.solver.point(unknown, omega, (0.0 * unknown, 1.0), 0, 0.0, homotopy.options.step)
    point, reached = _with_free_frequency(homotopy, start, 0.0, follow_top=False)
    if reached < 1.0 and thorough:
        point, reached = _with_free_frequency(homotopy, point, reached, follow_top=True)
    if reached >= 1.0:
        return Carried((point,), 1.0)
    if not fixed_frequency:
        return Carried((), reached)
    for before, after in pairwise(continue_in_parameter(homotopy, omega, unknown, 0.0, 1.0, MAX_POINTS)):
        reached = max(reached, min(after.omega - 1.0, 1.0))
        found = solution_between(homotopy, omega, before, after, 1.0)
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
    point, increment = start, (1.0 - s)
    smallest = SMALLEST_INCREMENT_OF_TOP if follow_top else SMALLEST_INCREMENT
    here, rate = _continuation(homotopy, s), None
    if follow_top:
        point, increment = _top(here, point), 0.125
    while s < 1.0 and increment >= smallest:
        target = min(s + increment, 1.0)
        there = _continuation(homotopy, target)
        rate = rate or _rate(homotopy, here, s, point)
        found = there.solver.refit(_predicted(point, rate, target - s))
        if found is None:
            increment /= 4.0
            continue
        point, here, rate = (_top(there, found) if follow_top else found), there, None
        s, increment = target, 2.0 * increment
    return point, s


def _rate(homotopy: Homotopy, here: Continuation, s: float, point: SolutionPoint) -> Tangent:
    """dx/ds and domega/ds of a solution at s, whose continuation is given, in the plane normal to its tangent."""
    change = homotopy.interference_change
    rate = None if change is None else here.solver.interference_rate(point, change)
    if rate is not None:
        return rate
    return rate_of_change(homotopy.balance(s), homotopy.balance(s + DIFFERENCE), DIFFERENCE, point)


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
    if not math.hypot(vibration, domega / point.metric.omega) <= MAX_MOVE:  # nor with a NaN
        return point
    return replace(point, unknown=point.unknown + dx, omega=point.omega + domega)


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


def continue_in_parameter(
    homotopy: Homotopy, omega: float, unknown: Array, s: float, direction: float, max_points: int
) -> Iterator[SolutionPoint]:
    """Points (x, 1 + s) of the curve through a solution at the homotopy parameter `s`, at one frequency.

    It ends beyond 0 or 1, after `max_points`, and where no next point is found. Folds in s are followed.
    Shapes: `unknown` (n,).
    """
    unit_range = 1.0 / (2.0 * math.pi), 2.0 / (2.0 * math.pi)  # Hz: omega from 1 to 2
    options = replace(homotopy.options, frequency_hz=unit_range)
    balance = FixedFrequencyBalance.of(homotopy, omega)
    parameters = ContinuationParameters(frequency_scale=PARAMETER_SCALE)
    continuation = Continuation(balance, options, parameters=parameters)
    towards = 0.0 * unknown, direction
    state = ContinuationState(continuation.solver.point(unknown, 1.0 + s, towards, 0, 0.0, options.step))
    yield state.point
    for _ in range(max_points):
        step = continuation.next_point(state)
        if step is None:
            return
        yield step.point
        if not 1.0 <= step.point.omega <= 2.0:
            return
        crossed = () if step.branch_point is None else (step.branch_point,)
        state = ContinuationState(step.point, state.point, state.branch_points + crossed)


def solution_between(
    homotopy: Homotopy, omega: float, before: SolutionPoint, after: SolutionPoint, s: float
) -> SolutionPoint | None:
    """The solution at the parameter `s` between two points of a curve over s; None if it does not lie between."""
    first, last = before.omega - 1.0 - s, after.omega - 1.0 - s
    if not first * last < 0.0:
        return None
    balance = homotopy.balance(s)
    guess = before.unknown + first / (first - last) * (after.unknown - before.unknown)
    solved = solve_at(balance, omega, guess, homotopy.options, MAX_ITERATIONS)
    if not solved.converged:
        return None
    solver = Continuation(balance, homotopy.options).solver
    towards = 0.0 * solved.solution, 1.0
    return solver.point(solved.solution, omega, towards, solved.iterations, 0.0, homotopy.options.step)
