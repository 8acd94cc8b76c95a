"""The solution nearest to a point of the (x, omega) space: Newton's method with the smallest (Moore-Penrose) step."""

from __future__ import annotations

import numpy as np

from nonlinear.contact.parameters import Array
from nonlinear.continuation.metric import Metric
from nonlinear.harmonic_balance.residual import HarmonicBalance

TOLERANCE = 1e-10  # relative residual; the solution is only a start
LARGEST_STEP = 1.0  # in the metric


def nearest_solution(
    balance: HarmonicBalance, unknown: Array, omega: float, metric: Metric, most_iterations: int = 15
) -> tuple[Array, float] | None:
    """A solution (x, omega) near a point; None where Newton's method does not converge.

    Each step is the smallest one, in the metric, that solves R + dR/dx dx + dR/domega domega = 0: no direction has to
    be known, as for a plane through the point.
    """
    x, w = unknown.copy(), omega
    for _ in range(most_iterations):
        linearised = balance.evaluate(x, w)
        if balance.relative_error(linearised.residual, x) < TOLERANCE:
            return x, w
        matrix = np.column_stack([linearised.jacobian * metric.length, linearised.dR_domega * metric.omega])
        step = -np.linalg.lstsq(matrix, linearised.residual, rcond=None)[0]
        if not np.linalg.norm(step) < LARGEST_STEP:
            return None
        x, w = x + metric.length * step[:-1], w + metric.omega * float(step[-1])
    return None
