"""Damped Newton's method at a fixed frequency (backtracking on the norm of the residual)."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from nonlinear.contact.parameters import Array

MAX_ITERATIONS = 40
SMALLEST_DAMPING = 1.0 / 256.0


class Linearised(Protocol):
    """R(x) and, when asked for, a solution with dR/dx."""

    @property
    def residual(self) -> Array:
        """R, (n,)."""
        ...

    def solve(self, right: Array) -> Array:
        """(dR/dx)^-1 b for a right-hand side b, (n,); NaN or infinity if dR/dx is singular."""
        ...


@dataclass(frozen=True)
class NewtonResult:
    """Result of an iteration."""

    solution: Array  # (n,), last iterate
    converged: bool  # whether it solves the equations
    iterations: int  # iterations done
    residual: float  # relative residual of the last iterate


@dataclass
class ConvergenceMonitor:
    """Decides from the relative errors of an iteration whether it has converged.

    The smallest error within reach depends on the stiffness of the contacts relative to that of the structure.
    Therefore an iteration has also converged if it stagnates: once at an error below `round_off`, or three times in
    a row at an error below 1000 `round_off`.
    """

    tolerance: float
    round_off: float
    previous: float = np.inf
    stagnations: int = 0

    def converged(self, error: float) -> bool:
        """Take the relative error of the next iterate."""
        self.stagnations = self.stagnations + 1 if error >= 0.3 * self.previous else 0
        self.previous = error
        stagnates = (error <= self.round_off and self.stagnations >= 1) or (
            error <= 1e3 * self.round_off and self.stagnations >= 3
        )
        return error <= self.tolerance or stagnates


def newton(
    linearise: Callable[[Array], Linearised],
    guess: Array,
    *,
    error: Callable[[Array, Array], float],
    tolerance: float,
    round_off: float,
    max_iterations: int = MAX_ITERATIONS,
) -> NewtonResult:
    """Solve R(x) = 0 by damped Newton steps.

    A step that does not reduce the norm of R is halved, down to 1/256. The shortest step is taken in any case: so
    the iteration can leave a kink of a piecewise smooth residual.
    Shapes: `guess` (n,).
    """
    monitor = ConvergenceMonitor(tolerance, round_off)
    x = guess
    linearised = linearise(x)
    relative = error(linearised.residual, x)
    for iteration in range(max_iterations):
        converged = monitor.converged(relative)
        if converged or not np.isfinite(relative):
            return NewtonResult(x, converged, iteration, relative)
        step = linearised.solve(-linearised.residual)
        if not np.isfinite(step).all():
            return NewtonResult(x, False, iteration, relative)
        norm = np.linalg.norm(linearised.residual)
        damping = 1.0
        while True:
            trial = x + damping * step
            linearised = linearise(trial)
            if np.linalg.norm(linearised.residual) < (1.0 - 0.25 * damping) * norm or damping <= SMALLEST_DAMPING:
                break
            damping /= 2.0
        x = trial
        relative = error(linearised.residual, x)
    return NewtonResult(x, monitor.converged(relative), max_iterations, relative)
