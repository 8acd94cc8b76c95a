"""Acceptance of a continuation step: whether the point found continues the curve, or ends it.

The corrector may converge to another segment of the curve nearby. Three tests tell: the sign of the bordered
determinant, the angle between the tangents, and the deviation from their mean. At a branch point the curve goes
straight on with the other sign; at a kink it may turn by more than a right angle.
"""

import numpy as np

from nonlinear.continuation.corrector import BorderedSystem
from nonlinear.continuation.predictor_corrector import PredictorCorrector
from nonlinear.continuation.solution_point import Metric, SolutionPoint
from nonlinear.continuation.step_control import ContinuationParameters


def follows_curve(point: SolutionPoint, found: SolutionPoint, parameters: ContinuationParameters) -> bool:
    """Whether `found` continues the curve from `point`."""
    return found.bordered_sign == point.bordered_sign and is_smooth_step(point, found, parameters)


def is_smooth_step(point: SolutionPoint, found: SolutionPoint, parameters: ContinuationParameters) -> bool:
    """Whether the tangents at both points allow a smooth curve, or a kink in a short step, between them."""
    return not changes_direction(point, found, parameters) and not leaves_mean_tangent(point, found, parameters)


def changes_direction(point: SolutionPoint, found: SolutionPoint, parameters: ContinuationParameters) -> bool:
    """Whether the tangent changes by more than the largest angle, in a step too long to cross a kink."""
    if found.arc - point.arc <= parameters.kink_step:
        return False
    return point.metric.product(point.tangent, point.metric.unit(found.tangent)) < parameters.min_cosine


def leaves_mean_tangent(point: SolutionPoint, found: SolutionPoint, parameters: ContinuationParameters) -> bool:
    """Whether the step jumps to a neighbouring segment of the curve.

    Between two points of one smooth segment the chord agrees with the mean of the two tangents up to the third power
    of the step. A kink between the points changes it by at most half of the difference of the tangents. A
    neighbouring segment runs parallel at a distance.
    """
    metric = point.metric
    first, last = point.tangent, metric.unit(found.tangent)
    chord = found.unknown - point.unknown, found.parameter - point.parameter
    length = metric.norm(*chord)
    tangent_change = metric.norm(last[0] - first[0], last[1] - first[1])
    deviation = (
        chord[0] - 0.5 * length * (first[0] + last[0]),
        chord[1] - 0.5 * length * (first[1] + last[1]),
    )
    return metric.norm(*deviation) > length * (0.5 * tangent_change + parameters.max_mean_tangent_deviation)


def distance(one: SolutionPoint, other: SolutionPoint, metric: Metric) -> float:
    """Distance of two points."""
    return metric.norm(one.unknown - other.unknown, one.parameter - other.parameter)


def distance_along_tangent(point: SolutionPoint, other: SolutionPoint) -> float:
    """Distance from `point` to `other`, projected on the tangent at `point`."""
    chord = other.unknown - point.unknown, other.parameter - point.parameter
    return point.metric.product(chord, point.tangent)


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


def passes_through(
    solver: PredictorCorrector, point: SolutionPoint, found: SolutionPoint, start: SolutionPoint
) -> bool:
    """Whether the curve passes through `start` between its neighbouring points `point` and `found`: it is closed."""
    if start.balance is not point.balance:
        return False
    step = distance_along_tangent(point, start)
    if start.bordered_sign != point.bordered_sign or not 0.0 < step <= found.arc - point.arc:
        return False
    metric = point.metric
    deviation = start.unknown - point.unknown - step * point.tangent[0]
    if metric.norm(deviation, start.parameter - point.parameter - step * point.tangent[1]) > step:
        return False
    same = solver.step(point, step)
    return same is not None and metric.norm(same.unknown - start.unknown, 0.0) <= solver.parameters.same_solution


def passed_limit(parameter: float, limits: tuple[float, float]) -> float | None:
    """The limit of the range of the parameter that is reached or passed; None inside the range."""
    low, high = limits
    return high if parameter >= high else low if parameter <= low else None


def point_beyond_kink(solver: PredictorCorrector, point: SolutionPoint) -> SolutionPoint | None:
    """The next point beyond a kink, where no plane normal to the tangent meets the curve; None if not found.

    The tangent beyond the kink is that of the equations a little ahead of `point`, on the side that keeps the sign of
    the bordered determinant.
    """
    metric, parameters = point.metric, solver.parameters
    for ahead in np.geomspace(parameters.kink_step, solver.options.min_step, 13):
        unknown = point.unknown + ahead * point.tangent[0]
        linearised = solver.balance.evaluate(unknown, point.parameter + ahead * point.tangent[1])
        tangent, sign, _ = BorderedSystem.factorise(linearised, point.tangent, metric).tangent()
        beyond = tangent if sign == point.bordered_sign else (-tangent[0], -tangent[1])
        for step in (ahead, 10.0 * ahead):
            found = solver.step(point, step, beyond)
            if found is not None and metric.product(metric.unit(found.tangent), beyond) > parameters.min_cosine:
                return found
    return None
