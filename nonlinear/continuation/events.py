"""Events that end a branch: the curve closes, or leaves the frequency range."""

from nonlinear.continuation.acceptance import distance_along_tangent
from nonlinear.continuation.predictor_corrector import PredictorCorrector
from nonlinear.continuation.solution_point import SolutionPoint


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
    if metric.norm(deviation, start.omega - point.omega - step * point.tangent[1]) > step:
        return False
    same = solver.step(point, step)
    return same is not None and metric.norm(same.unknown - start.unknown, 0.0) <= solver.parameters.same_solution


def passed_limit(omega: float, omega_range: tuple[float, float]) -> float | None:
    """The limit of the frequency range (rad/s) that `omega` has reached or passed; None inside the range."""
    low, high = omega_range
    return high if omega >= high else low if omega <= low else None
