"""Steps across a kink at which the curve turns by more than a right angle."""

import numpy as np

from nonlinear.continuation.bordered_system import BorderedSystem
from nonlinear.continuation.predictor_corrector import PredictorCorrector
from nonlinear.continuation.solution_point import SolutionPoint


def point_beyond_kink(solver: PredictorCorrector, point: SolutionPoint) -> SolutionPoint | None:
    """The next point beyond a kink, where no plane normal to the tangent meets the curve; None if not found.

    The tangent beyond the kink is that of the equations a little ahead of `point`, on the side that keeps the sign of
    the bordered determinant.
    """
    metric, parameters = point.metric, solver.parameters
    for ahead in np.geomspace(parameters.kink_step, solver.options.min_step, 13):
        unknown = point.unknown + ahead * point.tangent[0]
        linearised = solver.balance.evaluate(unknown, point.omega + ahead * point.tangent[1])
        tangent, sign, _ = BorderedSystem.factorise(linearised, point.tangent, metric).tangent()
        beyond = tangent if sign == point.bordered_sign else (-tangent[0], -tangent[1])
        for step in (ahead, 10.0 * ahead):
            found = solver.step(point, step, beyond)
            if found is not None and metric.product(metric.unit(found.tangent), beyond) > parameters.min_cosine:
                return found
    return None
