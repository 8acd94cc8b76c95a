"""Lowest or highest amplitude over all admissible residual tractions, with the balance as constraint.

Each step solves the balance (at a peak: and the peak condition) for given tractions, and takes the exact gradient of
the amplitude from the adjoint equation. The tractions are variables in a box. First the corner to which the gradient
points is tried: most extremes are there. Then a quasi-Newton method (L-BFGS-B) takes over, since where nodes begin
to slip the amplitude has a kink, and the extreme may lie on it.

With the amplitude A(x, omega, f) of the output, the balance R(x, omega, p) = 0 and forces f(x, p) that depend on
parameters p, the adjoint solution lambda of dR/dx^T lambda = dA/dx gives for every p at once

    dA/dp = dA/df . df/dp - lambda . dR/dp = (dA/df + G^H lambda) . df/dp,

since dR/dp = -G df/dp. On a curve this is the change at constant frequency. At a peak, where A is stationary along
the curve, it is that of the peak amplitude as well (envelope theorem).
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from nonlinear.branches.special_points import locate_zero
from nonlinear.contact.fourier import to_complex, to_real
from nonlinear.contact.parameters import Array, ContactElement, ContactForces, ContactParameters
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.response_quantities import (
    amplitude_derivative,
    complex_force,
    largest_amplitude,
    output_amplitude,
    with_mean,
)
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.residual import LinearisedResidual
from nonlinear.options import Measure

FIRST_STEP = 0.02  # arc length of the first step
MAX_STEPS = 80
MAX_ITERATIONS = 20
FREE = 1e-9  # a traction is free if its limits differ by more than this part of the largest mean traction
BEYOND = 2.0  # start of a slider, in bounds of its motion and of its elastic limit: beyond every admissible position
SMALLEST_MOVE = 1.0 / 64.0  # towards given tractions, part of the way
MAX_CORNERS = 6
MAX_QUASI_NEWTON = 40  # amplitudes that L-BFGS-B may ask for
SAME = 1e-7  # relative difference of amplitudes that counts as none


def amplitude_sensitivity(
    linearised: LinearisedResidual, output: str, mean: Measure, peak: SolutionPoint | None = None
) -> Array:
    """Derivative of the amplitude of an output by a change of the contact forces, (2H+1, n_c, 3), m/N.

    Shapes: returns (2H+1, n_c, 3).
    """
    direct, adjoint = amplitude_adjoint(linearised, output, mean, peak)
    balance, shape = linearised.balance, linearised.contact.force.shape
    rows = np.zeros((shape[0], shape[1] * 3))
    rows[balance.first_row :] = adjoint.reshape(-1, rows.shape[1])
    back = balance.receptance.matrix(linearised.omega).conj().transpose(0, 2, 1) @ to_complex(rows)[..., None]
    return direct + to_real(back[..., 0]).reshape(shape)


def amplitude_adjoint(
    linearised: LinearisedResidual, output: str, mean: Measure, peak: SolutionPoint | None = None
) -> tuple[Array, Array]:
    """dA/df (2H+1, n_c, 3) at constant displacement, m/N, and the adjoint solution lambda (n,).

    Parameters as in `amplitude_sensitivity`.
    """
    balance, omega, contact = linearised.balance, linearised.omega, linearised.contact
    receptance, shape = balance.receptance, contact.force.shape
    coordinates, dcoordinates = receptance.modal_response(omega, complex_force(contact))
    amplitude = largest_amplitude(with_mean(receptance.output(output, coordinates), mean))
    turn = amplitude.sign * np.exp(1j * np.arange(coordinates.shape[0]) * amplitude.angle)
    if mean is not None:
        turn = with_mean(turn, mean if mean == "harmonic_1" else 0.0)
    # Re(sum_h row_h f_h) = conj(row) . f in real coefficients
    direct = to_real((receptance.output_rows(output, omega) * turn[:, None]).conj()).reshape(shape)
    dA_dx = np.einsum("ika,kabij->jkb", direct, contact.jacobian)[balance.first_row :].reshape(-1)
    if peak is None:
        return direct, np.linalg.solve(linearised.jacobian.T, dA_dx)
    dA_domega = float((turn * receptance.output(output, dcoordinates)).sum().real)
    return direct, _bordered_adjoint(linearised, peak, dA_dx, dA_domega)


def _bordered_adjoint(linearised: LinearisedResidual, peak: SolutionPoint, dA_dx: Array, dA_domega: float) -> Array:
    """The adjoint solution of the system bordered by the tangent of the curve, scaled by its metric."""
    metric, size = peak.metric, dA_dx.size
    matrix = np.empty((size + 1, size + 1))
    matrix[:size, :size] = linearised.jacobian
    matrix[:size, size] = linearised.dR_dp * (metric.parameter / metric.length)
    matrix[size, :size], matrix[size, size] = peak.tangent[0] / metric.length, peak.tangent[1] / metric.parameter
    right = np.append(dA_dx, dA_domega * metric.parameter / metric.length)
    return np.asarray(np.linalg.solve(matrix.T, right)[:size], dtype=np.float64)


def nearest_peak(continuation: Continuation, point: SolutionPoint, mean: float | None) -> SolutionPoint | None:
    """The peak reached from near `point` by following the curve of `continuation` uphill; None if there is none.

    `point` may be a solution of other equations of the same size: the curve is entered in the plane normal to its
    tangent or, where that fails, at its frequency. The peak is located to the peak tolerance. `mean`: displacement in
    place of harmonic 0 of the output, m (see `output_amplitude`).
    """

    def growth(point: SolutionPoint) -> float:
        contact = point.balance.element.evaluate(point.displacement)
        return amplitude_derivative(replace(point, contact=contact), continuation.options.output, mean)

    start = continuation.solver.refit(point) or solution_at_frequency(continuation, point)
    if start is None:
        return None
    start = replace(start, step=FIRST_STEP)
    uphill = start if growth(start) >= 0.0 else start.reversed()
    low, high = continuation.options.omega_range
    for before, after in pairwise(continuation.points(uphill, MAX_STEPS)):
        if growth(after) <= 0.0:
            return locate_zero(continuation, before, after, growth) or before
        if not low <= after.omega <= high:
            return None
    return None


def solution_at_frequency(continuation: Continuation, point: SolutionPoint) -> SolutionPoint | None:
    """The solution of the equations of `continuation` at the frequency of `point`, a solution of similar ones."""
    solver = continuation.solver
    return solver.solution_at(point.omega, point.unknown, point.tangent, MAX_ITERATIONS, step=FIRST_STEP)


class TractionElement(ContactElement, Protocol):
    """A contact element with variables, (n_c, 2) from -1 to 1, on which the residual tractions depend."""

    def at(self, variables: Array) -> "TractionElement":
        """The same element at other variables (n_c, 2)."""
        ...

    def origin(self, displacement: Array, forces: ContactForces) -> Array:
        """Start of the sliders that leads to the `forces` of a displacement, (n_c, 2), m."""
        ...

    def derivative(self, displacement: Array, forces: ContactForces) -> Array:
        """Derivative of the force coefficients by the variables, (2H+1, n_c, 3, 2), N.

        [i, k, a, c]: of component a at node k by variable c of this node. `forces` are those of the `displacement`.
        """
        ...


def farthest_position(contact: ContactParameters, displacement: Array) -> Array:
    """Bound of the positions (n_c, 2) from which a slider is not moved, m: of abs(u) + mu N / kt over the period.

    `displacement`: (2H+1, n_c, 3) real coefficients, m.
    """

    def bound(rows: Array) -> Array:
        return np.asarray(np.abs(rows[0]) + np.hypot(rows[1::2], rows[2::2]).sum(axis=0), dtype=np.float64)

    limit, kt = contact.friction * bound(contact.load_coefficients(displacement)), contact.tangential_stiffness
    elastic = np.divide(limit, kt, out=np.zeros_like(limit), where=kt > 0.0)
    return bound(displacement[:, :, :2]) + elastic[:, None]


def free_tractions(contact: ContactParameters, element: ContactElement, displacement: Array) -> NDArray[np.bool_]:
    """Which tractions T1, T2 depend on where the slider started, (n_c, 2): the residual ones, free within limits.

    Forces from four starts beyond all admissible positions are compared. `element` has the parameters `contact`.
    """
    beyond = BEYOND * farthest_position(contact, contact.from_slider_origin(displacement))
    tractions = []
    for first, second in ((1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)):
        shifted = displacement.copy()
        shifted[0, :, :2] += beyond * [first, second]
        tractions.append(element.evaluate(shifted).force[0, :, :2])
    spread = np.ptp(tractions, axis=0)
    return np.asarray(spread > FREE * np.abs(tractions).max(), dtype=np.bool_)


@dataclass(frozen=True)
class TractionLevels:
    """Two sliders per node, whose residual tractions stand at a level between their limits (see `ContactElement`).

    A slider that sticks all the time may stand anywhere in [max_t(u - mu N / kt), min_t(u + mu N / kt)] (Gulisano et
    al. 2011, eqs. 10-16). Started far below this interval it ends at its lower end, started far above at its upper
    end. The force is linear in the position: at the level m it is

        f(m) = (1 - m) / 2 f_low + (1 + m) / 2 f_high,    -1 <= m <= 1,

    exactly, with its Jacobian. A slider that slips or opens has the same cycle from every start: f_low = f_high. So
    the force is as smooth in m as in the displacement, and the limits of Coulomb's law need no further constraint.
    """

    contact: ContactParameters  # parameters of the nodes, `law` "two_sliders"; `slider_origin` has no influence
    element: ContactElement  # the element of these parameters
    level: Array  # (n_c, 2), m along t1 and t2; -1: the slider at the lower end, the traction at its upper limit

    def at(self, variables: Array) -> "TractionLevels":
        """The same element at other levels (n_c, 2)."""
        return TractionLevels(self.contact, self.element, variables)

    def limits(self, displacement: Array) -> tuple[ContactForces, ContactForces]:
        """Forces from sliders that start far below and far above."""
        beyond = BEYOND * farthest_position(self.contact, self.contact.from_slider_origin(displacement))
        shifted = np.stack([displacement, displacement])
        shifted[0, 0, :, :2] += beyond
        shifted[1, 0, :, :2] -= beyond
        return self.element.evaluate(shifted[0]), self.element.evaluate(shifted[1])

    def evaluate(self, displacement: Array) -> ContactForces:
        """Forces and Jacobian for real coefficients `displacement` (2H+1, n_c, 3), metres."""
        low, high = self.limits(displacement)
        weight = np.ones((self.level.shape[0], 3))  # of f_high; the normal forces are the same
        weight[:, :2] = 0.5 * (1.0 + self.level)
        force = low.force + weight * (high.force - low.force)
        jacobian = low.jacobian + weight[:, :, None, None, None] * (high.jacobian - low.jacobian)
        return ContactForces(force, jacobian, np.maximum(low.state, high.state))

    def level_of(self, force: Array, displacement: Array) -> Array:
        """The level (n_c, 2) of a contact force (2H+1, n_c, 3) of the displacement; 0 where it is not free."""
        low, high = (forces.force[0, :, :2] for forces in self.limits(displacement))
        width = high - low
        level = np.divide(2.0 * force[0, :, :2] - low - high, width, out=np.zeros_like(width), where=width != 0.0)
        return np.asarray(np.clip(level, -1.0, 1.0), dtype=np.float64)

    def origin(self, displacement: Array, forces: ContactForces) -> Array:
        """w = u - T / kt; beyond every admissible position at the levels -1 and 1, which hold all along a curve."""
        kt = np.where(self.contact.tangential_stiffness > 0.0, self.contact.tangential_stiffness, 1.0)
        position = displacement[0, :, :2] + forces.force[0, :, :2] / kt[:, None]
        beyond = BEYOND * farthest_position(self.contact, displacement)
        return np.asarray(position + np.where(np.abs(self.level) == 1.0, self.level * beyond, 0.0), dtype=np.float64)

    def derivative(self, displacement: Array, forces: ContactForces) -> Array:
        """Derivative of the force by the levels, (f_high - f_low) / 2; see `TractionElement`."""
        low, high = self.limits(displacement)
        half = 0.5 * (high.force - low.force)
        result = np.zeros((*half.shape, 2))
        for c in range(2):
            result[:, :, c, c] = half[:, :, c]
        return result


@dataclass(frozen=True)
class TractionOrigins:
    """An element whose sliders start at given places in a box (see `ContactElement`); for the friction cone.

    There the admissible positions are no interval, but the common part of the discs abs(u - w) <= mu N / kt.
    A slider that starts outside is drawn in by Coulomb's law, so that every place of the box is admissible. Places
    beside the mean displacement, `with_mean`, reach all tractions of a body that moves with them, such as a damper.
    """

    element: ContactElement  # the element, its sliders starting at 0
    # `centre`, `radius`: (n_c, 2), centre and half widths of the box, m
    centre: Array
    radius: Array
    place: Array  # (n_c, 2), place in the box, -1 to 1
    with_mean: bool = False  # whether places are beside the mean displacement, which the tractions then do not feel

    def at(self, variables: Array) -> "TractionOrigins":
        """The same element at other places (n_c, 2)."""
        return replace(self, place=variables)

    def _shifted(self, displacement: Array) -> Array:
        """The displacement from the places where the sliders start."""
        shifted = displacement.copy()
        shifted[0, :, :2] -= self.origin(displacement)
        return shifted

    def evaluate(self, displacement: Array) -> ContactForces:
        """Forces and Jacobian for real coefficients `displacement` (2H+1, n_c, 3), metres."""
        forces = self.element.evaluate(self._shifted(displacement))
        if not self.with_mean:
            return forces
        jacobian = forces.jacobian.copy()
        jacobian[:, :, :2, :, 0] = 0.0  # [b, k, j, a, i]: of the mean along t1 and t2
        return replace(forces, jacobian=jacobian)

    def origin(self, displacement: Array, forces: ContactForces | None = None) -> Array:
        """The place itself, (n_c, 2), m."""
        places = self.centre + self.radius * self.place
        return displacement[0, :, :2] + places if self.with_mean else places

    def derivative(self, displacement: Array, forces: ContactForces) -> Array:
        """Derivative of the force by the places; see `TractionElement`."""
        if self.with_mean:
            forces = self.element.evaluate(self._shifted(displacement))
        return force_by_origin(forces) * self.radius[:, None, :]


def force_by_origin(forces: ContactForces) -> Array:
    """Derivative of the force by where the sliders start, (2H+1, n_c, 3, 2), N/m: -df/du of harmonic 0.

    [i, k, a, c]: coefficient i of component a at node k by w0 along t1 or t2 of this node.
    """
    return -forces.jacobian[:, :, :2, :, 0].transpose(3, 0, 1, 2)


class SearchStop(Exception):
    """The amplitude is not known for the tractions that the optimiser asks for."""


@dataclass(frozen=True)
class TractionState:
    """A solution for given residual tractions."""

    variables: Array  # (n_c, 2), variables of the tractions, -1 to 1
    point: SolutionPoint  # the solution: a peak, or the response at a given frequency
    amplitude: float  # amplitude of the output, m
    gradient: Array  # (n_c, 2), derivative of the amplitude by the variables, m


@dataclass
class TractionSearch:
    """Amplitudes as a function of the residual tractions; every solution found is kept."""

    continuation: Continuation  # continuation of the balance, without linear segments and exponents
    element: TractionElement  # contact element of the tractions
    mean: float | None = None  # displacement in place of harmonic 0 of the output, m (see `output_amplitude`)
    fixed_frequency: bool = False  # the response at the frequency of the start is meant, not the peak
    states: list[TractionState] = field(default_factory=list)  # what has been solved so far

    def start(self, variables: Array, point: SolutionPoint) -> TractionState | None:
        """Solve for given variables from a solution of nearly the same tractions."""
        return self._solve(variables, point)

    def move(self, variables: Array) -> TractionState | None:
        """Solve for given variables from the nearest state, in smaller moves if need be."""
        origin = min(self.states, key=lambda state: float(np.abs(state.variables - variables).sum()))
        done, part = 0.0, 1.0
        while done < 1.0:
            target = min(done + part, 1.0)
            found = self._solve(
                origin.variables + (target - done) / (1.0 - done) * (variables - origin.variables), origin.point
            )
            if found is None:
                part /= 2.0
                if part < SMALLEST_MOVE:
                    return None
            else:
                origin, done = found, target
        return origin

    def _solve(self, variables: Array, point: SolutionPoint) -> TractionState | None:
        current = self._at(variables, point)
        if self.fixed_frequency:
            found = solution_at_frequency(current, point)
        else:
            found = nearest_peak(current, point, self.mean)
        if found is None:
            return None
        linearised = current.balance.evaluate(found.unknown, found.omega)
        output, peak = current.options.output, None if self.fixed_frequency else found
        sensitivity = amplitude_sensitivity(linearised, output, self.mean, peak)
        displacement = current.balance.displacement(found.unknown)
        derivative = self.element.at(variables).derivative(displacement, linearised.contact)
        gradient = np.einsum("ika,ikac->kc", sensitivity, derivative)
        found = replace(found, contact=linearised.contact)
        state = TractionState(variables, found, output_amplitude(found, output, self.mean), gradient)
        self.states.append(state)
        return state

    def _at(self, variables: Array, point: SolutionPoint) -> Continuation:
        balance = replace(self.continuation.balance, element=self.element.at(variables))
        return replace(self.continuation, balance=balance, contact=None, stability=None, adapt=None)

    def unloading_corners(self, state: TractionState) -> Array:
        """The corners that reduce the mean normal load of each node most, (n_c, n_c, 2), to first order."""
        element = self.element.at(state.variables)
        balance = replace(state.point.balance, element=element)
        linearised = balance.evaluate(state.point.unknown, state.point.omega)
        derivative = element.derivative(balance.displacement(state.point.unknown), linearised.contact)[0]
        n = balance.n_contacts
        forces = np.zeros((n, 3, n, 2))  # mean force at each node by the variables
        forces[np.arange(n), :, np.arange(n)] = derivative
        change = np.zeros((balance.size, 2 * n))
        change[: 3 * n] = balance.receptance.matrix(state.point.omega)[0].real @ forces.reshape(3 * n, 2 * n)
        normal = np.linalg.solve(linearised.jacobian, change)[: 3 * n].reshape(n, 3, n, 2)[:, 2]
        return np.where(normal > 0.0, -1.0, 1.0)

    def extreme(self, start: TractionState, sign: float) -> TractionState:
        """The state of highest (`sign` 1) or lowest (-1) amplitude found from a state."""
        best = self.through_corners(start, sign)
        return self._quasi_newton(best, sign)

    def through_corners(self, state: TractionState, sign: float) -> TractionState:
        """Go to the corner that the gradient points to, as long as the amplitude improves."""
        for _ in range(MAX_CORNERS):
            slope = sign * state.gradient
            negligible = SAME * state.amplitude
            corner = np.where(slope > negligible, 1.0, np.where(slope < -negligible, -1.0, state.variables))
            if np.array_equal(corner, state.variables):
                return state
            found = self.move(corner)
            if found is None or sign * (found.amplitude - state.amplitude) <= SAME * state.amplitude:
                return state
            state = found
        return state

    def _quasi_newton(self, start: TractionState, sign: float) -> TractionState:
        """L-BFGS-B from a state; the best state of all that it has asked for."""
        from scipy.optimize import minimize

        scale, best = start.amplitude, start

        def value(flat: Array) -> tuple[float, Array]:
            nonlocal best
            variables = flat.reshape(start.variables.shape)
            known = [state for state in self.states if np.array_equal(state.variables, variables)]
            state = known[-1] if known else self.move(variables)
            if state is None:
                raise SearchStop
            if sign * (state.amplitude - best.amplitude) > 0.0:
                best = state
            return -sign * state.amplitude / scale, -sign * state.gradient.reshape(-1) / scale

        # slopes that do not point out of the box
        inward = np.where(np.abs(start.variables) < 1.0, start.gradient, 0.0)
        inward += np.where(start.variables * sign * start.gradient < 0.0, start.gradient, 0.0)
        if np.abs(inward).max() <= SAME * scale:
            return start
        with suppress(SearchStop):
            minimize(
                value,
                start.variables.reshape(-1),
                jac=True,
                method="L-BFGS-B",
                bounds=[(-1.0, 1.0)] * start.variables.size,
                options={"maxfun": MAX_QUASI_NEWTON, "ftol": SAME, "gtol": SAME},
            )
        return best


def minimax(
    heights: Callable[[Array], Array],
    slopes: Callable[[Array], Array],
    start: Array,
    bounds: Sequence[tuple[float, float]],
    tolerance: float,
    iterations: int,
) -> Array:
    """The place (n,) in a box at which the largest of k functions is least, by sequential quadratic programming.

    Minimised is a bound t with heights(x) <= t; `slopes` gives their exact gradients, (k, n).
    """
    from scipy.optimize import minimize

    found = minimize(
        lambda x: float(x[-1]),
        np.append(start, heights(start).max()),
        jac=lambda x: np.eye(x.size)[-1],
        bounds=[*bounds, (0.0, None)],
        constraints={
            "type": "ineq",
            "fun": lambda x: x[-1] - heights(x[:-1]),
            "jac": lambda x: np.column_stack([-slopes(x[:-1]), np.ones(len(heights(x[:-1])))]),
        },
        method="SLSQP",
        options={"ftol": tolerance, "maxiter": iterations},
    )
    return np.asarray(found.x[:-1], dtype=np.float64)


def lowest_of_peaks(searches: Sequence[TractionSearch], start: Array) -> Array:
    """Variables (n_c, 2) at which the largest of several peaks of one curve is least, from a start."""
    known: dict[bytes, list[TractionState]] = {}
    scale = max(search.states[0].amplitude for search in searches)

    def states(flat: Array) -> list[TractionState]:
        variables = flat.reshape(start.shape)
        key = variables.tobytes()
        if key not in known:
            if len(known) == MAX_QUASI_NEWTON:
                raise SearchStop
            found = [search.move(variables) for search in searches]
            known[key] = [state for state in found if state is not None]
            if len(known[key]) < len(searches):
                del known[key]
                raise SearchStop
        return known[key]

    with suppress(SearchStop):
        minimax(
            lambda flat: np.array([state.amplitude / scale for state in states(flat)]),
            lambda flat: np.array([state.gradient.reshape(-1) / scale for state in states(flat)]),
            start.reshape(-1),
            [(-1.0, 1.0)] * start.size,
            SAME,
            MAX_QUASI_NEWTON,
        )
    largest = {max(state.amplitude for state in each): each[0].variables for each in known.values()}
    return largest[min(largest)] if largest else start
