"""Newton's method in a plane across the curve: from a predicted point to the solution."""

from dataclasses import dataclass

import numpy as np

from nonlinear.contact.parameters import Array
from nonlinear.continuation.bordered_system import BorderedSystem
from nonlinear.continuation.metric import Metric, Tangent
from nonlinear.harmonic_balance.newton import Convergence
from nonlinear.harmonic_balance.residual import BalanceAt, HarmonicBalance
from nonlinear.options import SolverOptions

MAX_CORRECTIONS = 12
SAME_SYSTEM = 1e-3  # part of the error that a step leaves if its system may give the tangent too


@dataclass(frozen=True)
class Corrected:
    """A solution (x, w), its balance, iterations, and the last step's system if it is as good as that of the end."""

    unknown: Array
    omega: float
    at: BalanceAt
    system: BorderedSystem | None
    iterations: int


@dataclass(frozen=True)
class Plane:
    """The plane through (x, w) normal to a unit `direction`; solutions farther than `farthest` count as none."""

    unknown: Array
    omega: float
    direction: Tangent
    metric: Metric
    farthest: float

    def distance(self, unknown: Array, omega: float) -> float:
        """From the base point of the plane."""
        return self.metric.norm(unknown - self.unknown, omega - self.omega)


def correct(
    balance: HarmonicBalance, options: SolverOptions, plane: Plane, offset: Tangent | None = None
) -> Corrected | None:
    """Solve R(x, w) = 0 in the plane from its base point, or from `offset` beside it; None if that does not succeed.

    Factors of the Jacobian serve a second and third step where the errors so far tell that these then suffice: with
    an error e and a contraction c of the last step, the next with the same factors leaves 2 c e or less.
    """
    x, w = plane.unknown, plane.omega
    if offset is not None:
        x, w = x + offset[0], w + offset[1]
    watch = Convergence(options.tolerance, options.round_off)
    system, before, first = None, np.inf, np.inf
    for iteration in range(MAX_CORRECTIONS + 1):
        at = balance.evaluate(x, w)
        error = balance.relative_error(at.residual, x)
        contraction = error / before
        if first == np.inf:  # of this system; the next ones may be round-off
            first = contraction
        if watch.reached(error):
            return Corrected(x, w, at, system if first <= SAME_SYSTEM else None, iteration)
        if iteration == MAX_CORRECTIONS or not np.isfinite(error):
            return None
        if system is None or error * (2.0 * contraction) ** 2 > options.tolerance:
            system, first = BorderedSystem.factorise(at, plane.direction, plane.metric), np.inf
        dx, dw = system.step(at.residual)
        x, w, before = x + dx, w + dw, error
        # a step that is no number fails here too
        if not (w > 0.0 and plane.distance(x, w) <= plane.farthest):
            return None
    return None
