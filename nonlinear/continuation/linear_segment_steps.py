"""Steps of the continuation along a linear stretch, up to its very end."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nonlinear.contact.parameters import Array
from nonlinear.continuation.linear_segment_system import LinearMotion, LinearSegmentSystem
from nonlinear.continuation.linear_segments import LinearSegments
from nonlinear.continuation.metric import Metric
from nonlinear.continuation.solution_point import SolutionPoint

SHORTEST = 1e-10  # relative step in frequency that is none: the end of the stretch is reached
END_TOLERANCE = 1e-14


@dataclass(frozen=True)
class LinearSegmentSteps:
    """Follows linear solutions in the frequency; `output` is the one whose amplitude counts.

    `metric` gives the scales at an unknown.
    """

    stretches: LinearSegments
    metric: Callable[[Array], Metric]
    output: str

    def step(self, point: SolutionPoint, step: float) -> SolutionPoint | None:
        """The point about `step` beyond `point` on its linear stretch, or the end of that if it comes before.

        None: `point` is on no linear stretch, or this is its end. The arc of the new point is its distance along the
        tangent; its own `step` is the one made.
        """
        state = point.linear or self.stretches.state(point.displacement)
        if state is None:
            return None
        system = self.stretches.system(state)
        ahead = point.omega + step * point.tangent[1]
        motion = system.motion(ahead)
        if system.margin(motion.displacement) < 0.0:
            ahead = _end(system, point.omega, ahead)
            if abs(ahead - point.omega) <= SHORTEST * point.omega:
                return None
            motion = system.motion(ahead)
        unknown = self.stretches.balance.unknown(motion.displacement)
        along = point.metric.product((unknown - point.unknown, ahead - point.omega), point.tangent)
        direction = math.copysign(1.0, point.tangent[1])
        return self._point(system, motion, ahead, (direction, point.arc + along, along))

    def start(self, omega: float, direction: float, first_step: float) -> SolutionPoint | None:
        """The linear solution at w = `omega`, all contacts open or all stuck; None if neither is one.

        `direction`: +1 or -1, the way that the curve is to go in frequency.
        """
        for system in self.stretches.uniform():
            motion = system.motion(omega)
            found = self.stretches.state(motion.displacement)
            if found is not None and np.array_equal(found.pressed, system.state.pressed):
                return self._point(system, motion, omega, (direction, 0.0, first_step))
        return None

    def _point(
        self, system: LinearSegmentSystem, motion: LinearMotion, omega: float, record: tuple[float, float, float]
    ) -> SolutionPoint:
        """The solved point; record: direction, arc and step. A stable linear structure has det dR/dx > 0."""
        direction, arc, step = record
        balance = system.balance
        unknown, slope = balance.unknown(motion.displacement), balance.unknown(motion.derivative)
        metric = self.metric(unknown)
        tangent = metric.unit((direction * slope, direction))
        return SolutionPoint(
            balance=balance,
            unknown=unknown,
            omega=omega,
            tangent=tangent,
            metric=metric,
            contact=system.forces(motion.displacement),
            determinant_sign=1,
            orientation=int(direction),
            iterations=0,
            arc=arc,
            step=step,
            amplitude_slope=tangent[1] * motion.growth(balance.receptance.modal.outputs[self.output]),
            linear=system.state,
        )


def _end(system: LinearSegmentSystem, inside: float, outside: float) -> float:
    """The last frequency on the near side of the end of a stretch, to round-off."""
    from scipy.optimize import brentq

    def margin(omega: float) -> float:
        return system.margin(system.motion(omega).displacement)

    if margin(inside) <= 0.0:
        return inside
    end = float(brentq(margin, inside, outside, xtol=END_TOLERANCE * inside, rtol=1e-15))
    back = math.copysign(END_TOLERANCE * inside, inside - end)
    for _ in range(12):
        if margin(end) >= 0.0:
            return end
        back *= 2.0
        end += back
    return inside
