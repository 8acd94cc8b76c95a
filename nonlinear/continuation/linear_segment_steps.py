"""Steps of the continuation along a linear segment, up to its very end."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from nonlinear.contact.parameters import Array
from nonlinear.continuation.linear_segment_system import LinearMotion, LinearSegmentSystem
from nonlinear.continuation.linear_segments import LinearSegments
from nonlinear.continuation.metric import Metric
from nonlinear.continuation.response_quantities import amplitude_derivative
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.continuation.zero_bracket import closed_bracket

SHORTEST_STEP = 1e-10  # relative to the frequency; a shorter step means that the end of the segment is reached
END_TOLERANCE = 1e-14


@dataclass(frozen=True)
class LinearSegmentSteps:
    """Follows linear solutions in the frequency."""

    segments: LinearSegments  # the linear solutions
    metric: Callable[[Array], Metric]  # scales at an unknown (n,)
    output: str  # name of the output whose amplitude is recorded

    def step(self, point: SolutionPoint, step: float) -> SolutionPoint | None:
        """The point about `step` beyond `point` on its linear segment, or the end of the segment if that is nearer.

        None if `point` is on no linear segment, or at its end. The arc length of the new point is its distance along
        the tangent; its own `step` is the one made.
        """
        state = self.segments.state_at(point)
        if state is None:
            return None
        system = self.segments.system(state)
        omega = point.omega + step * point.tangent[1]
        motion = system.motion(omega)
        margin = system.margin(motion.displacement)
        if margin < 0.0:
            omega = _end(system, point.omega, (omega, margin))
            if abs(omega - point.omega) <= SHORTEST_STEP * point.omega:
                return None
            motion = system.motion(omega)
        unknown = self.segments.balance.unknown(motion.displacement)
        length = point.metric.product((unknown - point.unknown, omega - point.omega), point.tangent)
        direction = math.copysign(1.0, point.tangent[1])
        return self._point(system, motion, omega, (direction, point.arc + length, length))

    def start(self, omega: float, direction: float, first_step: float) -> SolutionPoint | None:
        """The linear solution at `omega` (rad/s), all contacts open or all stuck; None if neither is a solution.

        `direction`: +1 or -1, the direction of the branch in frequency.
        """
        for system in self.segments.uniform():
            motion = system.motion(omega)
            found = self.segments.state(motion.displacement)
            if found is not None and np.array_equal(found.pressed, system.state.pressed):
                return self._point(system, motion, omega, (direction, 0.0, first_step))
        return None

    def _point(
        self, system: LinearSegmentSystem, motion: LinearMotion, omega: float, record: tuple[float, float, float]
    ) -> SolutionPoint:
        """The solved point; `record`: direction, arc and step. A stable linear structure has det dR/dx > 0."""
        direction, arc, step = record
        balance = system.balance
        unknown, dx_domega = balance.unknown(motion.displacement), balance.unknown(motion.derivative)
        metric = self.metric(unknown)
        tangent = metric.unit((direction * dx_domega, direction))
        point = SolutionPoint(
            balance=balance,
            unknown=unknown,
            omega=omega,
            tangent=tangent,
            metric=metric,
            contact=system.forces(motion.displacement),
            jacobian_sign=1,
            bordered_sign=int(direction),
            iterations=0,
            arc=arc,
            step=step,
            dA_ds=tangent[1] * motion.growth(system.output_shape(self.output)),
            linear=system.state,
        )
        if system.harmonics == (1,):
            return point
        return replace(point, dA_ds=amplitude_derivative(point, self.output))


def _end(system: LinearSegmentSystem, inside: float, outside: tuple[float, float]) -> float:
    """The last frequency (rad/s) inside a segment, to round-off; `outside`: one beyond it and the margin there."""

    def margin(omega: float) -> float:
        return system.margin(system.motion(omega).displacement)

    least = margin(inside)
    if least <= 0.0:
        return inside
    return closed_bracket(margin, (inside, least), outside, END_TOLERANCE * inside)[0][0]
