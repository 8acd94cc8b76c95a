"""Solutions that a curve over the interference, at fixed frequency, meets at the interference asked for.

At one frequency the solutions of all interferences form a curve from the stuck response (a large interference) to the
free one (a wide gap). Where it turns back and passes the interference asked for again, there are more solutions than
that of the main branch: also those of isolated branches. Force and interference scaled together scale the response,
so that the curve over the force tells nothing new.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from nonlinear.contact.fourier import ComplexArray, to_complex, to_real
from nonlinear.contact.parameters import Array
from nonlinear.continuation.arclength_continuation import Continuation, ContinuationState
from nonlinear.continuation.linear_segments import LinearSegments
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.continuation.step_control import ContinuationParameters
from nonlinear.harmonic_balance.initial_solution import solve_at
from nonlinear.harmonic_balance.residual import (
    HarmonicBalance,
    InterferenceChange,
    InterferencePath,
    LinearisedResidual,
)

SPREAD = 3  # frequencies evenly over the range at which there is a curve
AMONG_FOLDS = 4  # the same between the lowest and the highest fold of the branches with fewer harmonics
MAX_POINTS = 60  # of a curve, in each direction
RANGE = 2.0  # of the interference on both sides, in largest normal displacements of the main branch
# the curve only has to lead to starting points, which are solved to the tolerance asked for
PARAMETERS = ContinuationParameters(frequency_scale=0.25, target_deviation=0.3, largest_factor=4.0, kink_step=0.05)
MAX_STEP = 0.5  # arc length
TOLERANCE, ROUND_OFF = 1e-5, 1e-9  # relative residuals
MAX_ITERATIONS = 15
MIDDLE, LOW, HIGH = 2.0, 1.0, 3.0  # the parameter at the interference asked for, and at the ends of the range


@dataclass(frozen=True, kw_only=True)
class InterferenceBalance(HarmonicBalance):
    """The balance at one frequency with the interference in the place of the frequency.

    The same interference is added at every node. The contact force depends on d_n + v0 only, so that it is added to
    harmonic 0 of the normal displacement.
    """

    frequency: float  # excitation frequency, rad/s
    unit: float  # interference per unit of the parameter, m

    @classmethod
    def of(cls, balance: HarmonicBalance, frequency: float, unit: float) -> "InterferenceBalance":
        """The balances of all interferences at one frequency."""
        return cls(
            receptance=balance.receptance,
            element=balance.element,
            frozen_static=balance.frozen_static,
            tiny=balance.tiny,
            odd=balance.odd,
            frequency=frequency,
            unit=unit,
        )

    @cached_property
    def interference_path(self) -> InterferencePath:
        """The interference in the place of the frequency."""
        change = InterferenceChange(np.full(self.n_contacts, self.unit), np.zeros(self.size))
        return InterferencePath(change, self.frequency, MIDDLE)

    def closing(self, unknown: Array, parameter: float) -> Array:
        """The displacement (2H+1, n_c, 3) that the contacts with the interference asked for see, m.

        Shapes: `unknown` (n,).
        """
        displacement = self.displacement(unknown).copy()
        displacement[0, :, 2] += (parameter - MIDDLE) * self.unit
        return displacement

    def evaluate(self, unknown: Array, omega: float) -> LinearisedResidual:
        """Residual and derivatives; `dR_domega` is the derivative with respect to the parameter.

        Shapes: `unknown` (n,).
        """
        contact = self.element.evaluate(self.closing(unknown, omega))
        derivative = self.unit * contact.jacobian[:, :, 2, :, 0].transpose(2, 0, 1)
        rows = derivative.shape[0]
        forces = np.stack([contact.force.reshape(rows, -1), derivative.reshape(rows, -1)], axis=-1)
        motion = to_real(self._matrix @ to_complex(forces))[self.first_row :]
        residual = unknown - self._linear - motion[..., 0].reshape(-1)
        return LinearisedResidual(self, self.frequency, residual, -motion[..., 1].reshape(-1), contact)

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


def solutions_over_interference(
    continuation: Continuation, main: list[SolutionPoint], folds: Sequence[float] = ()
) -> Iterator[tuple[SolutionPoint, str]]:
    """Solutions on curves over the interference through points of the main branch, and how they were found."""
    contact = continuation.contact
    if contact is None or contact.odd:
        return
    unit = RANGE * max(_normal_motion(point) for point in main)
    omega = np.array([point.omega for point in main])
    spread = np.linspace(*continuation.options.omega_range, SPREAD + 2)[1:-1]
    among = np.linspace(min(folds), max(folds), AMONG_FOLDS + 2)[1:-1] if len(folds) else ()
    for place in dict.fromkeys(int(np.argmin(np.abs(omega - wanted))) for wanted in (*among, *spread)):
        start = main[place]
        balance = InterferenceBalance.of(continuation.balance, start.omega, unit)
        origin = f"the curve over the interference at {start.omega / (2.0 * np.pi):.4g} Hz"
        for direction in (1.0, -1.0):
            for before, after in pairwise(_curve(balance, continuation, start.unknown, direction)):
                found = _solution_between(continuation, start.omega, before, after)
                if found is not None:
                    yield found, origin


def _normal_motion(point: SolutionPoint) -> float:
    """Bound of the normal vibration of the contacts, m."""
    rows = point.displacement[1:, :, 2]
    return float(np.hypot(rows[::2], rows[1::2]).sum(axis=0).max())


def _curve(
    balance: InterferenceBalance, problem: Continuation, unknown: Array, direction: float
) -> Iterator[SolutionPoint]:
    """Points of the curve over the interference from the one asked for, to an end of the range."""
    limits = LOW / (2.0 * math.pi), HIGH / (2.0 * math.pi)
    options = replace(
        problem.options, frequency_hz=limits, tolerance=TOLERANCE, round_off=ROUND_OFF, max_step=MAX_STEP
    )
    continuation = Continuation(balance, options, parameters=PARAMETERS)
    state = ContinuationState(
        continuation.solver.point(unknown, MIDDLE, (0.0 * unknown, direction), 0, 0.0, options.step)
    )
    yield state.point
    for _ in range(MAX_POINTS):
        end = None if problem.linear is None else _linear_end(balance, problem.linear.segments, state.point)
        if end is not None:
            yield end
            return
        step = continuation.next_point(state)
        if step is None:
            return
        yield step.point
        if not LOW < step.point.omega < HIGH:
            return
        crossed = () if step.branch_point is None else (step.branch_point,)
        state = ContinuationState(step.point, state.point, state.branch_points + crossed)


def _linear_end(balance: InterferenceBalance, segments: LinearSegments, point: SolutionPoint) -> SolutionPoint | None:
    """The end of the range, where no contact changes its state on the way; else None.

    The motions of one linear state are a convex set: if both ends of a straight line belong to it, the line does.
    """
    state = segments.state(balance.closing(point.unknown, point.omega))
    if state is None or point.tangent[1] == 0.0:
        return None
    limit = HIGH if point.tangent[1] > 0.0 else LOW
    unknown = point.unknown + (limit - point.omega) / point.tangent[1] * point.tangent[0]
    last = segments.state(balance.closing(unknown, limit))
    if last is None or not np.array_equal(last.pressed, state.pressed):
        return None
    return replace(point, unknown=unknown, omega=limit)


def _solution_between(
    continuation: Continuation, omega: float, before: SolutionPoint, after: SolutionPoint
) -> SolutionPoint | None:
    """The solution at the interference asked for between two points of a curve over it; None if there is none."""
    first, last = before.omega - MIDDLE, after.omega - MIDDLE
    if not first * last < 0.0:
        return None
    guess = before.unknown + first / (first - last) * (after.unknown - before.unknown)
    options = continuation.options
    solved = solve_at(continuation.balance, omega, guess, options, MAX_ITERATIONS)
    if not solved.converged:
        return None
    towards = 0.0 * solved.solution, 1.0
    return continuation.solver.point(solved.solution, omega, towards, solved.iterations, 0.0, options.step)
