"""Predictor of the next point: the tangent, with the correction of the cubic through the last two points."""

from nonlinear.continuation.metric import Metric, Tangent
from nonlinear.continuation.solution_point import SolutionPoint

SMALLEST_COSINE = 0.5  # of the angle between the last two tangents
LARGEST_EXTRAPOLATION = 3.0  # relative to the distance of the last two points


def cubic_offset(previous: SolutionPoint, point: SolutionPoint, step: float, metric: Metric) -> Tangent | None:
    """Distance of the cubic Hermite extrapolation from the tangent, `step` beyond `point` and normal to the tangent.

    Let r be the distance of `previous` from the tangent line, at -L along it, and r' the derivative of r there. The
    offset is c2 s^2 + c3 s^3 with c2 = (r' L + 3 r) / L^2 and c3 = (r' L + 2 r) / L^3. None if the step is too long
    for an extrapolation or the tangents differ too much.
    """
    back = previous.unknown - point.unknown, previous.omega - point.omega
    length = -metric.product(back, point.tangent)
    if (
        length * LARGEST_EXTRAPOLATION < step
        or metric.product(metric.unit(previous.tangent), point.tangent) < SMALLEST_COSINE
    ):
        return None
    ratio = step / length
    weight_r, weight_dr = ratio**2 * (3.0 + 2.0 * ratio), ratio**2 * (1.0 + ratio) * length
    # r = back + L t and r' = t_previous / (t_previous . t) - t, so the offset is a sum of three known steps
    weight_previous = weight_dr / metric.product(previous.tangent, point.tangent)
    weight_tangent = weight_r * length - weight_dr
    displacement = weight_r * back[0] + weight_previous * previous.tangent[0] + weight_tangent * point.tangent[0]
    omega = weight_r * back[1] + weight_previous * previous.tangent[1] + weight_tangent * point.tangent[1]
    return displacement, omega
