"""Steps across a branch point, through which the curve goes straight on."""

from nonlinear.continuation.acceptance import (
    changes_direction,
    distance,
    distance_along_tangent,
    is_smooth_step,
)
from nonlinear.continuation.metric import Metric
from nonlinear.continuation.parameters import ContinuationParameters
from nonlinear.continuation.predictor_corrector import PredictorCorrector
from nonlinear.continuation.solution_point import SolutionPoint

BISECTIONS = (0.5, 0.3, 0.7)  # parts of the interval that are tried; the middle may be the singular point itself


def find_crossed_branch_point(
    solver: PredictorCorrector,
    point: SolutionPoint,
    found: SolutionPoint,
    step: float,
    crossed: tuple[SolutionPoint, ...],
) -> SolutionPoint | None:
    """The first point beyond a branch point between `point` and `found`; None if no branch point is crossed.

    The sign of the bordered determinant changes at a branch point. Its place is bisected, down to a gap, which an
    inexact symmetry may leave. If the sign changed because the step jumped to a neighbouring segment of opposite
    direction, the bisection finds the segment of `point` again: then the gap does not close.
    """
    parameters = solver.parameters
    if found.bordered_sign == point.bordered_sign or not is_smooth_step(point, found, parameters):
        return None
    metric = point.metric
    near, interval = point, step
    while interval > parameters.branch_point_gap:
        for part in BISECTIONS:
            middle = solver.step(near, part * interval)
            if middle is not None:
                break
        else:
            return None
        if middle.bordered_sign == point.bordered_sign and not changes_direction(near, middle, parameters):
            near, interval = middle, distance_along_tangent(middle, found)
        else:
            found, interval = middle, part * interval
    if interval < 0.0 or distance(near, found, metric) > 2.0 * parameters.branch_point_gap:
        return None
    return None if _is_known(found, crossed, metric, parameters) else found


def _is_known(
    found: SolutionPoint, crossed: tuple[SolutionPoint, ...], metric: Metric, parameters: ContinuationParameters
) -> bool:
    """Whether a branch point was crossed before along the same line, with the same harmonics."""
    for other in crossed:
        if other.balance is not found.balance:
            continue
        cosine = abs(metric.product(metric.unit(other.tangent), metric.unit(found.tangent)))
        if cosine > parameters.min_cosine and distance(other, found, metric) < parameters.same_branch_point:
            return True
    return False
