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


@dataclass
class Convergence:
    """Watches the relative error of an iteration: solved within `tolerance`, or as near as round-off lets it come.

    How near that is depends on the stiffness of the contacts against that of the structure: an error below
    `round_off` that stops falling counts as solved, and so does one a thousand times larger that has stopped thrice.
    """

    tolerance: float
    round_off: float
    before: float = np.inf
    stops: int = 0

    def reached(self, error: float) -> bool:
        """Take the error of the next iterate."""
        self.stops = self.stops + 1 if error >= 0.3 * self.before else 0
        self.before = error
        stopped = (error <= self.round_off and self.stops >= 1) or (error <= 1e3 * self.round_off and self.stops >= 3)
        return error <= self.tolerance or stopped


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

    `error(R, x)` is the relative error that `Convergence` watches. A step that does not reduce |R| is
    halved, down to a 256th; the shortest one is taken as it is, which lets a piecewise smooth problem leave a kink.
    """
    watch = Convergence(tolerance, round_off)
    x = guess
    residual, jacobian = linearise(x)
    relative = error(residual, x)
    for iteration in range(max_iterations):
        solved = watch.reached(relative)
        if solved or not np.isfinite(relative):
            return NewtonResult(x, solved, iteration, relative)
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
        relative = error(residual, x)
    return NewtonResult(x, watch.reached(relative), max_iterations, relative)
