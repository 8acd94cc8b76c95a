"""Newton's method at a fixed frequency, damped where the full step does not help."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nonlinear.contact import Array

MAX_ITERATIONS = 40
SMALLEST_DAMPING = 1.0 / 256.0


@dataclass(frozen=True)
class NewtonResult:
    """Last iterate (n,), whether it solves the equations, iterations done, and the relative residual."""

    solution: Array
    converged: bool
    iterations: int
    residual: float


def newton(
    linearise: Callable[[Array], tuple[Array, Array]],
    guess: Array,
    *,
    error: Callable[[Array, Array], float],
    tolerance: float,
    round_off: float,
    max_iterations: int = MAX_ITERATIONS,
) -> NewtonResult:
    """Solve R(x) = 0 from `guess`; `linearise(x)` returns R (n,) and dR/dx (n, n).

    Converged when the relative error `error(R, x)` is at most `tolerance`, or at most `round_off` and no longer
    falling. A step that does not reduce |R| is
    halved, down to a 256th; the shortest one is taken as it is, which lets a piecewise smooth problem leave a kink.
    """
    x = guess
    residual, jacobian = linearise(x)
    relative = error(residual, x)
    for iteration in range(max_iterations):
        if relative <= tolerance or not np.isfinite(relative):
            return NewtonResult(x, bool(relative <= tolerance), iteration, relative)
        try:
            step = np.linalg.solve(jacobian, -residual)
        except np.linalg.LinAlgError:
            return NewtonResult(x, False, iteration, relative)
        size = np.linalg.norm(residual)
        damping = 1.0
        while True:
            trial = x + damping * step
            residual, jacobian = linearise(trial)
            if np.linalg.norm(residual) < (1.0 - 0.25 * damping) * size or damping <= SMALLEST_DAMPING:
                break
            damping /= 2.0
        x = trial
        before, relative = relative, error(residual, x)
        if relative <= round_off and relative >= 0.3 * before:
            return NewtonResult(x, True, iteration + 1, relative)
    return NewtonResult(x, bool(relative <= tolerance), max_iterations, relative)
