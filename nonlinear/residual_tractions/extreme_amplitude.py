"""Lowest or highest amplitude over all admissible residual tractions, with the balance as constraint.

Each step solves the balance (at a peak: and the peak condition) for given tractions, and takes the exact gradient of
the amplitude from the adjoint equation. The tractions are variables in a box. First the corner to which the gradient
points is tried: most extremes are there. Then a quasi-Newton method (L-BFGS-B) takes over, since where nodes begin
to slip the amplitude has a kink, and the extreme may lie on it.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from nonlinear.contact.parameters import Array
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.response_quantities import output_amplitude
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.residual_tractions.amplitude_sensitivity import amplitude_sensitivity
from nonlinear.residual_tractions.peak_search import nearest_peak, solution_at_frequency
from nonlinear.residual_tractions.traction_levels import TractionElement

SMALLEST_MOVE = 1.0 / 64.0  # towards given tractions, part of the way
MAX_CORNERS = 6
MAX_QUASI_NEWTON = 40  # amplitudes that L-BFGS-B may ask for
SAME = 1e-7  # relative difference of amplitudes that counts as none


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


def lowest_of_peaks(searches: Sequence[TractionSearch], start: Array) -> Array:
    """Variables (n_c, 2) at which the largest of several peaks of one curve is least, by SLSQP from a start.

    Minimised is a bound of all of them, with their exact gradients.
    """
    from scipy.optimize import minimize

    known: dict[bytes, list[TractionState]] = {}
    scale = max(search.states[0].amplitude for search in searches)

    def states(values: Array) -> list[TractionState]:
        variables = values[:-1].reshape(start.shape)
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

    def below(values: Array) -> Array:
        return np.array([values[-1] - state.amplitude / scale for state in states(values)])

    def slopes(values: Array) -> Array:
        return np.array([np.append(-state.gradient.reshape(-1) / scale, 1.0) for state in states(values)])

    with suppress(SearchStop):
        first = np.append(start.reshape(-1), 0.0)
        first[-1] = max(state.amplitude for state in states(first)) / scale
        minimize(
            lambda values: values[-1],
            first,
            jac=lambda values: np.eye(values.size)[-1],
            method="SLSQP",
            bounds=[*[(-1.0, 1.0)] * start.size, (0.0, None)],
            constraints={"type": "ineq", "fun": below, "jac": slopes},
            options={"ftol": SAME, "maxiter": MAX_QUASI_NEWTON},
        )
    largest = {max(state.amplitude for state in each): each[0].variables for each in known.values()}
    return largest[min(largest)] if largest else start
