"""Newton's method at a fixed frequency, damped where the full step does not help."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from nonlinear.contact.parameters import Array

MAX_ITERATIONS = 40
SMALLEST_DAMPING = 1.0 / 256.0


class Linearised(Protocol):
    """R(x) and, when asked for, dR/dx."""

    @property
    def residual(self) -> Array:
        """(n,)."""
        ...

    @property
    def jacobian(self) -> Array:
        """(n, n)."""
        ...


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
    linearise: Callable[[Array], Linearised],
    guess: Array,
    *,
    error: Callable[[Array, Array], float],
    tolerance: float,
    round_off: float,
    max_iterations: int = MAX_ITERATIONS,
) -> NewtonResult:
    """Solve R(x) = 0 from `guess`; `linearise(x)` returns R with its derivative.

    `error(R, x)` is the relative error that `Convergence` watches. A step that does not reduce |R| is
    halved, down to a 256th; the shortest one is taken as it is, which lets a piecewise smooth problem leave a kink.
    """
    watch = Convergence(tolerance, round_off)
    x = guess
    at = linearise(x)
    relative = error(at.residual, x)
    for iteration in range(max_iterations):
        solved = watch.reached(relative)
        if solved or not np.isfinite(relative):
            return NewtonResult(x, solved, iteration, relative)
        try:
            step = np.linalg.solve(at.jacobian, -at.residual)
        except np.linalg.LinAlgError:
            return NewtonResult(x, False, iteration, relative)
        size = np.linalg.norm(at.residual)
        damping = 1.0
        while True:
            trial = x + damping * step
            at = linearise(trial)
            if np.linalg.norm(at.residual) < (1.0 - 0.25 * damping) * size or damping <= SMALLEST_DAMPING:
                break
            damping /= 2.0
        x = trial
        relative = error(at.residual, x)
    return NewtonResult(x, watch.reached(relative), max_iterations, relative)
