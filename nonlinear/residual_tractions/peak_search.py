"""The peak of a curve near a solution with other residual tractions."""

from dataclasses import replace

from nonlinear.branches.special_point_location import locate_zero
from nonlinear.continuation.arclength_continuation import Continuation, ContinuationState
from nonlinear.continuation.response_quantities import amplitude_derivative
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.initial_solution import solve_at

FIRST_STEP = 0.02  # arc length of the first step
MAX_STEPS = 80
MAX_ITERATIONS = 20


def nearest_peak(continuation: Continuation, point: SolutionPoint, mean: float | None) -> SolutionPoint | None:
    """The peak reached from near `point` by following the curve of `continuation` uphill; None if there is none.

    `point` may be a solution of other equations of the same size: the curve is entered in the plane normal to its
    tangent or, where that fails, at its frequency. The peak is located to the peak tolerance. `mean`: displacement in
    place of harmonic 0 of the output, m (see `output_amplitude`).
    """

    def growth(point: SolutionPoint) -> float:
        contact = point.balance.element.evaluate(point.displacement)
        return amplitude_derivative(replace(point, contact=contact), continuation.options.output, mean)

    start = continuation.solver.refit(point) or solution_at_frequency(continuation, point)
    if start is None:
        return None
    start = replace(start, step=FIRST_STEP)
    state = ContinuationState(start if growth(start) >= 0.0 else start.reversed())
    for _ in range(MAX_STEPS):
        step = continuation.next_point(state)
        if step is None:
            return None
        before, after = state.point, step.point
        if growth(after) <= 0.0:
            return locate_zero(continuation, before, after, growth) or before
        low, high = continuation.options.omega_range
        if not low <= after.omega <= high:
            return None
        state = ContinuationState(after, before)
    return None


def solution_at_frequency(continuation: Continuation, point: SolutionPoint) -> SolutionPoint | None:
    """The solution of the equations of `continuation` at the frequency of `point`, a solution of similar ones."""
    solved = solve_at(continuation.balance, point.omega, point.unknown, continuation.options, MAX_ITERATIONS)
    if not solved.converged:
        return None
    return continuation.solver.point(solved.solution, point.omega, point.tangent, solved.iterations, 0.0, FIRST_STEP)
