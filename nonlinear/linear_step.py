"""Steps of the continuation along a linear stretch, up to its very end."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from nonlinear.arclength import Metric
from nonlinear.balance import HarmonicBalance
from nonlinear.contact import Array
from nonlinear.curve_point import CurvePoint, LinearState
from nonlinear.linear_stretch import LinearStretches

SHORTEST = 1e-10  # relative step in frequency that is none: the end of the stretch is reached
END_TOLERANCE = 1e-14


@dataclass(frozen=True)
class LinearSteps:
    """Follows the linear solutions of a `balance` in the frequency; `metric` gives the scales at an unknown."""

    balance: HarmonicBalance
    stretches: LinearStretches
    metric: Callable[[Array], Metric]
    statics: dict[bytes, Array] = field(default_factory=dict)  # harmonic 0 of the states met so far

    def step(self, point: CurvePoint, step: float) -> CurvePoint | None:
        """The point about `step` beyond `point` on its linear stretch, or the end of that if it comes before.

        None: `point` is on no linear stretch, or this is its end. The arc of the new point is its distance along the
        tangent; its own `step` is the one made.
        """
        state = point.linear or self.stretches.state(point.displacement)
        if state is None:
            return None
        ahead = point.frequency + step * point.tangent[1]
        rows, slope = self._solve(state, ahead)
        if self.stretches.margin(state, rows) < 0.0:
            ahead = self._end(state, point.frequency, ahead)
            if abs(ahead - point.frequency) <= SHORTEST * point.frequency:
                return None
            rows, slope = self._solve(state, ahead)
        moved = self.balance.unknown(rows) - point.unknown, ahead - point.frequency
        along = self.metric(point.unknown).product(moved, point.tangent)
        return self._point(state, (rows, slope), ahead, (float(np.sign(point.tangent[1])), point.arc + along, along))

    def start(self, frequency: float, direction: float, first_step: float) -> CurvePoint | None:
        """The linear solution at w = `frequency`, all contacts open or all stuck; None if neither is one.

        `direction`: +1 or -1, the way that the curve is to go in frequency.
        """
        for pressed in (False, True):
            state = LinearState(np.full(self.balance.n_contacts, pressed))
            rows, slope = self._solve(state, frequency)
            found = self.stretches.state(rows)
            if found is not None and np.array_equal(found.pressed, state.pressed):
                return self._point(state, (rows, slope), frequency, (direction, 0.0, first_step))
        return None

    def _point(
        self, state: LinearState, solution: tuple[Array, Array], frequency: float, record: tuple[float, float, float]
    ) -> CurvePoint:
        """The solved point; record: direction, arc and step. A stable linear structure has det dR/dx > 0."""
        (rows, slope), (direction, arc, step) = solution, record
        unknown = self.balance.unknown(rows)
        tangent = self.metric(unknown).unit((direction * self.balance.unknown(slope), direction))
        contact = self.stretches.forces(state, rows)
        sign = int(direction)
        return CurvePoint(self.balance, unknown, frequency, tangent, contact, 1, sign, 0, arc, step, linear=state)

    def _solve(self, state: LinearState, frequency: float) -> tuple[Array, Array]:
        key = state.pressed.tobytes()
        if key not in self.statics:
            self.statics[key] = self.stretches.static(state)
        return self.stretches.solve(state, self.statics[key], frequency)

    def _end(self, state: LinearState, inside: float, outside: float) -> float:
        """The last frequency on the near side of the end of the stretch, to round-off."""
        from scipy.optimize import brentq

        def margin(frequency: float) -> float:
            return self.stretches.margin(state, self._solve(state, frequency)[0])

        if margin(inside) <= 0.0:
            return inside
        end = float(brentq(margin, inside, outside, xtol=END_TOLERANCE * inside, rtol=1e-15))
        back = np.sign(inside - end) * END_TOLERANCE * inside
        for _ in range(12):
            if margin(end) >= 0.0:
                return end
            back *= 2.0
            end += back
        return inside
