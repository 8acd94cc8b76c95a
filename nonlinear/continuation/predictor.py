"""First guesses of the next point: the tangent, bent by the cubic through the last two points and their tangents."""

from nonlinear.continuation.metric import Metric, Tangent
from nonlinear.continuation.solution_point import SolutionPoint

SMALLEST_COSINE = 0.5  # of the angle between the last two tangents
FARTHEST = 3.0  # extrapolation, relative to the distance of the last two points


def cubic_offset(previous: SolutionPoint, point: SolutionPoint, step: float, metric: Metric) -> Tangent | None:
    """How far the cubic Hermite extrapolation leaves the tangent at `step` beyond `point`: normal to the tangent.

    With r the distance of `previous` from the tangent line, at -L along it, and r' its slope there, the offset is
    c2 s^2 + c3 s^3, c2 = (r' L + 3 r) / L^2 and c3 = (r' L + 2 r) / L^3. None where the curve turned too much for
    that, or too little is known of it.
    """
    back = previous.unknown - point.unknown, previous.omega - point.omega
    length = -metric.product(back, point.tangent)
    if length * FARTHEST < step or metric.product(metric.unit(previous.tangent), point.tangent) < SMALLEST_COSINE:
        return None
    ratio = step / length
    of_distance, of_slope = ratio**2 * (3.0 + 2.0 * ratio), ratio**2 * (1.0 + ratio) * length
    # r = back + L t and r' = t_before / (t_before . t) - t, so the offset is a sum of three known steps
    before = of_slope / metric.product(previous.tangent, point.tangent)
    along = of_distance * length - of_slope
    displacement = of_distance * back[0] + before * previous.tangent[0] + along * point.tangent[0]
    omega = of_distance * back[1] + before * previous.tangent[1] + along * point.tangent[1]
    return displacement, omega
