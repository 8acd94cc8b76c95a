"""Smallest ball around the points of many small clouds at once, by a primal-dual interior-point method.

With the centre c and t = R^2 - |c|^2 the smallest ball minimises |c|^2 + t under 2 p_i.c + t >= |p_i|^2: a quadratic
programme of few unknowns. Its dual, max sum_i l_i |p_i|^2 - |sum_i l_i p_i|^2 over weights l_i that add up to 1,
bounds R^2 from below.

References
----------
S. Boyd, L. Vandenberghe, Convex Optimization, Cambridge University Press (2004), sections 8.4.1 and 11.7.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_MOST_STEPS = 40
_CENTRING, _DAMPING = 0.1, 0.95


def enclosing_balls(points: Array, tolerance: float = 1e-4) -> tuple[Array, Array]:
    """Centres and radii of the smallest balls.

    Shapes: `points` (c, k, d), returns `centre` (c, d), `radius` (c,).
    """
    middle = points.mean(axis=1)
    shifted = points - middle[:, None]
    size = np.sqrt(np.sum(shifted**2, axis=-1).max(axis=1))
    found = np.zeros_like(middle)
    active = np.flatnonzero(size > 0.0)
    cloud = _Clouds(shifted[active] / size[active, None, None])
    for _ in range(_MOST_STEPS):
        if len(active) == 0:
            break
        done = cloud.upper() <= (1.0 + tolerance) ** 2 * cloud.lower()
        found[active] = cloud.centre
        active = active[~done]
        cloud.keep(~done)
        cloud.step()
    found[active] = cloud.centre
    centre = middle + size[:, None] * found
    return centre, np.sqrt(np.sum((points - centre[:, None]) ** 2, axis=-1).max(axis=1))


class _Clouds:
    """Iterates of the clouds (c, k, d) that are not finished; their points lie within 1 of the origin."""

    def __init__(self, points: Array) -> None:
        self.points = points
        self.squares = np.sum(points**2, axis=-1)
        self.rows = np.concatenate([2.0 * points, np.ones((*points.shape[:2], 1))], axis=-1)
        self.centre = np.zeros((len(points), points.shape[2]))
        self.height = np.full(len(points), 1.5)  # t
        self.weights = np.full(points.shape[:2], 1.0 / points.shape[1])

    def slack(self) -> Array:
        """2 p.c + t - |p|^2, (c, k)."""
        return (self.rows[..., :-1] @ self.centre[..., None])[..., 0] + self.height[:, None] - self.squares

    def upper(self) -> Array:
        """Squared distance of the farthest point from the centre (c,)."""
        return np.sum((self.points - self.centre[:, None]) ** 2, axis=-1).max(axis=1)

    def lower(self) -> Array:
        """Dual bound of the squared radius (c,)."""
        weights = self.weights / self.weights.sum(axis=1, keepdims=True)
        middle = (weights[:, None] @ self.points)[:, 0]
        return np.sum(weights * self.squares, axis=1) - np.sum(middle**2, axis=-1)

    def keep(self, chosen: NDArray[np.bool_]) -> None:
        """Go on with some clouds only."""
        if chosen.all():
            return
        for name in ("points", "squares", "rows", "centre", "height", "weights"):
            setattr(self, name, getattr(self, name)[chosen])

    def step(self) -> None:
        """One Newton step towards a tenth of the duality gap."""
        slack = self.slack()
        target = _CENTRING * np.mean(slack * self.weights, axis=1)[:, None] / slack
        transposed = self.rows.swapaxes(1, 2)
        matrix = transposed @ ((self.weights / slack)[..., None] * self.rows)
        d = self.centre.shape[1]
        matrix[:, np.arange(d), np.arange(d)] += 2.0
        gradient = np.concatenate([2.0 * self.centre, np.ones((len(slack), 1))], axis=1)
        gradient -= (transposed @ target[..., None])[..., 0]
        move = -np.linalg.solve(matrix, gradient[..., None])
        opening = (self.rows @ move)[..., 0]
        change = target - self.weights - self.weights / slack * opening
        length = np.minimum(_longest(slack, opening), _longest(self.weights, change))[:, None]
        self.centre = self.centre + length * move[:, :-1, 0]
        self.height = self.height + length[:, 0] * move[:, -1, 0]
        self.weights = self.weights + length * change


def _longest(values: Array, change: Array) -> Array:
    """Step (c,) up to 1 with which positive values (c, k) stay positive."""
    with np.errstate(divide="ignore", invalid="ignore"):
        limits = np.where(change < 0.0, -values / change, np.inf)
    return np.minimum(1.0, _DAMPING * limits.min(axis=1))
