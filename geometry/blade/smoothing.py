"""A mesh of quadrilaterals, untangled and smoothed by the shape of its quadrilaterals.

The corner with the edges a and b has the inverse mean ratio (|a|^2 + |b|^2) / (2 a x b), 1 for a square; the sum of
its squares over all corners is minimised. Folded corners have a x b <= 0; in place of it stands

    h = (a x b + sqrt((a x b)^2 + 4 delta^2)) / 2 > 0,

with delta from large to small.

References
----------
J. M. Escobar, E. Rodriguez, R. Montenegro, G. Montero, J. M. Gonzalez-Yuste, Simultaneous untangling and smoothing of
tetrahedral meshes, Computer Methods in Applied Mechanics and Engineering 192 (2003) 2775-2787.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from geometry.sector import FloatArray, IntArray

DELTAS = (0.1, 0.01, 0.001)  # of the mean area of a quadrilateral
ITERATIONS = 400  # for each of them
_CORNERS = ((0, 1, 3), (1, 2, 0), (2, 3, 1), (3, 0, 2))  # a corner of a quadrilateral, and its neighbours


@dataclass(frozen=True)
class Movable:
    """Which coordinates of n points may move, and which points follow others."""

    free: NDArray[np.bool_]  # (n, 2), coordinates that may move; of followers those of their leaders count
    leader: IntArray  # (n,), the point that each point follows, itself for most
    offset: FloatArray  # (n, 2), what a follower is ahead of its leader, m

    def numbers(self) -> IntArray:
        """Number of the unknown of each coordinate, -1 for none, (n, 2)."""
        own = self.free & (self.leader == np.arange(len(self.leader)))[:, None]
        numbers = np.full(self.free.shape, -1)
        numbers[own] = np.arange(np.count_nonzero(own))
        return np.asarray(numbers[self.leader])


def smoothed(points: FloatArray, quads: IntArray, movable: Movable) -> FloatArray:
    """Points (n, 2) of a mesh of quadrilaterals (q, 4), counterclockwise, with corners as square as they can be."""
    from scipy.optimize import minimize

    numbers = movable.numbers()
    moving, size = numbers >= 0, int(numbers.max(initial=-1)) + 1
    corners = quads[:, np.array(_CORNERS)].reshape(-1, 3)
    spread = np.ptp(points[quads], axis=1)
    area = float(np.prod(spread, axis=1).mean())
    length = float(np.sqrt(area))
    unknowns = np.zeros(size)
    leads = moving & (movable.leader == np.arange(len(points)))[:, None]
    unknowns[numbers[leads]] = points[leads] / length

    def placed(z: FloatArray) -> FloatArray:
        found = points.copy()
        found[moving] = length * z[numbers[moving]] + movable.offset[moving]
        return found

    def objective(delta: float) -> Callable[[FloatArray], tuple[float, FloatArray]]:
        def value(z: FloatArray) -> tuple[float, FloatArray]:
            total, slope = _distortion(placed(z), corners, delta)
            return total, np.bincount(numbers[moving], length * slope[moving], size).astype(float)

        return value

    for share in DELTAS:
        options = {"maxiter": ITERATIONS}
        unknowns = minimize(objective(share * area), unknowns, jac=True, method="L-BFGS-B", options=options).x
    return placed(unknowns)


def _distortion(points: FloatArray, corners: IntArray, delta: float) -> tuple[float, FloatArray]:
    """Sum of squares of the inverse mean ratios of corners (c, 3), times 4, and its derivatives (n, 2)."""
    a, b = points[corners[:, 1]] - points[corners[:, 0]], points[corners[:, 2]] - points[corners[:, 0]]
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    root = np.sqrt(cross**2 + 4.0 * delta**2)
    height = 0.5 * (cross + root)
    edges = (a**2).sum(axis=1) + (b**2).sum(axis=1)
    by_edges = (4.0 * edges / height**2)[:, None]
    by_cross = (-(edges**2) / height**3 * (1.0 + cross / root))[:, None]
    slope_a = by_edges * a + by_cross * np.stack([b[:, 1], -b[:, 0]], axis=1)
    slope_b = by_edges * b + by_cross * np.stack([-a[:, 1], a[:, 0]], axis=1)
    slopes = np.zeros_like(points)
    for column, slope in ((1, slope_a), (2, slope_b), (0, -slope_a - slope_b)):
        np.add.at(slopes, corners[:, column], slope)
    return float(np.sum((edges / height) ** 2)), slopes
