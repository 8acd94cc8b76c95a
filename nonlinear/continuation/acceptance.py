"""Acceptance tests of a continuation step: whether the point found continues the curve.

The corrector may converge to another segment of the curve nearby. Three tests tell: the sign of the bordered
determinant, the angle between the tangents, and the deviation from their mean.
"""

from nonlinear.continuation.metric import Metric
from nonlinear.continuation.parameters import ContinuationParameters
from nonlinear.continuation.solution_point import SolutionPoint


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
    chord = found.unknown - point.unknown, found.omega - point.omega
    length = metric.norm(*chord)
    tangent_change = metric.norm(last[0] - first[0], last[1] - first[1])
    deviation = (
        chord[0] - 0.5 * length * (first[0] + last[0]),
        chord[1] - 0.5 * length * (first[1] + last[1]),
    )
    return metric.norm(*deviation) > length * (0.5 * tangent_change + parameters.max_mean_tangent_deviation)


def distance(one: SolutionPoint, other: SolutionPoint, metric: Metric) -> float:
    """Distance of two points."""
    return metric.norm(one.unknown - other.unknown, one.omega - other.omega)


def distance_along_tangent(point: SolutionPoint, other: SolutionPoint) -> float:
    """Distance from `point` to `other`, projected on the tangent at `point`."""
    chord = other.unknown - point.unknown, other.omega - point.omega
    return point.metric.product(chord, point.tangent)
