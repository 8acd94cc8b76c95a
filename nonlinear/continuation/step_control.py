"""Length of the next step."""

from nonlinear.continuation.parameters import ContinuationParameters
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.options import SolverOptions


def next_step(
    step: float, deviation: float, iterations: int, options: SolverOptions, parameters: ContinuationParameters
) -> float:
    """Length of the step after one of length `step`.

    The deviation from the tangent grows with the square of the step, so deviation / step is proportional to the
    step: it is brought to `target_deviation`. Many iterations make the next step shorter.
    """
    factor = parameters.target_deviation / (deviation / step + 1e-12)
    following = step * min(max(factor, parameters.smallest_factor), parameters.largest_factor)
    if iterations > parameters.many_iterations:
        following = min(following, parameters.slow_factor * step)
    return min(following, options.max_step)


def step_to_resonance(
    point: SolutionPoint, step: float, resonances: tuple[float, ...], min_step: float, tolerance: float
) -> float:
    """The step, cut short where it would pass one of the `resonances` (rad/s).

    A resonance can be narrower than a step. `tolerance`: relative distance within which it counts as reached.
    """
    domega_ds = point.tangent[1]
    for resonance in resonances:
        distance = resonance - point.omega
        if distance * domega_ds > 0.0 and abs(distance) > tolerance * resonance:
            step = min(step, distance / domega_ds)
    return max(step, min_step)
