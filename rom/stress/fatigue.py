"""Fatigue of a periodic stress: amplitude and mean of a multiaxial cycle, Goodman and Haigh margins.

The cycle of a point is a closed path of its stress tensor. Amplitude: radius of the smallest ball around the path of
the deviator, in the norm that is the von Mises stress. Mean: von Mises stress of the centre of that ball, with the
sign of the mid-range of the first invariant (0: tension). For uniaxial and for proportional cycles these are half the
range and the mid-range. For shear stresses that turn at constant size the amplitude is that size.

The smallest balls of many small clouds are found at once, by a primal-dual interior-point method. With the centre c
and t = R^2 - |c|^2 the smallest ball minimises |c|^2 + t under 2 p_i.c + t >= |p_i|^2: a quadratic programme of few
unknowns. Its dual, max sum_i l_i |p_i|^2 - |sum_i l_i p_i|^2 over weights l_i that add up to 1, bounds R^2 from
below.

References
----------
K. Dang Van, B. Griveau, O. Message, On a new multiaxial fatigue limit criterion, in: Biaxial and Multiaxial Fatigue,
EGF 3 (1989) 479 (smallest ball around the deviatoric path).
J. E. Shigley, C. R. Mischke, Mechanical Engineering Design, McGraw-Hill (1989), chapter 7 (Goodman, Langer).
S. Boyd, L. Vandenberghe, Convex Optimization, Cambridge University Press (2004), sections 8.4.1 and 11.7.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rom.errors import require_between
from rom.stress.stress_recovery import deviator, von_mises

Array = NDArray[np.float64]
_MOST_STEPS = 40
_CENTRING, _DAMPING = 0.1, 0.95
# Instants of a period for each harmonic. The squared distance of the path from the centre is a trigonometric
# polynomial of the degree 2H: between N instants it exceeds the largest sample by 1 / cos(2 pi H / N) at most
# (Ehlich, Zeller 1964), here 0.5 %, the radius by 0.25 %.
SAMPLES = 64
BALL_TOLERANCE = 1e-4
_CHUNK_DOUBLES = 1_000_000


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


@dataclass(frozen=True)
class FatigueLimits:
    """Limits of a material: numbers, or one for each place."""

    endurance_limit: float | Array  # amplitude of a fully reversed cycle that it endures, Pa
    tensile_strength: float | Array  # ultimate tensile strength, Pa: end of the Goodman line
    yield_strength: float | Array | None = None  # yield strength, Pa; None: no yield line

    def __post_init__(self) -> None:
        if np.ndim(self.tensile_strength):
            return
        positive = "must be a number above 0 (Pa)"
        require_between("fatigue", "tensile_strength", self.tensile_strength, 0.0, math.inf, positive)
        below = "must be above 0 and at most the tensile strength (Pa)"
        highest = math.nextafter(float(self.tensile_strength), math.inf)
        require_between("fatigue", "endurance_limit", self.endurance_limit, 0.0, highest, below)
        if self.yield_strength is not None:
            require_between("fatigue", "yield_strength", self.yield_strength, 0.0, highest, below)

    def goodman_margin(self, amplitude: Any, mean: Any) -> Array:
        """Factor n by which amplitude and mean may grow together: 1/n = Sa/Se + Sm/Su.

        A mean below 0 (compression) counts as 0. Without stress the margin is infinite.

        `amplitude`, `mean`: amplitude Sa and signed mean Sm, Pa.
        """
        return _inverse(np.asarray(amplitude) / self.endurance_limit + np.maximum(mean, 0.0) / self.tensile_strength)

    def yield_margin(self, amplitude: Any, mean: Any) -> Array:
        """Factor up to the yield line, amplitude plus size of the mean = Sy (Langer); infinite without a limit."""
        largest = np.asarray(amplitude) + np.abs(mean)
        if self.yield_strength is None:
            return np.full(np.shape(largest), np.inf)
        return _inverse(largest / self.yield_strength)

    def margin(self, amplitude: Any, mean: Any) -> Array:
        """The smaller of both: margin in the Haigh diagram along a line from the origin."""
        return np.minimum(self.goodman_margin(amplitude, mean), self.yield_margin(amplitude, mean))

    def amplitude_margin(self, amplitude: Any, mean: Any) -> Array:
        """Factor by which the amplitude alone may grow at this mean; 0 where the mean alone is beyond the limits."""
        allowed = self.endurance_limit * (1.0 - np.maximum(mean, 0.0) / self.tensile_strength)
        if self.yield_strength is not None:
            allowed = np.minimum(allowed, self.yield_strength - np.abs(mean))
        allowed = np.maximum(allowed, 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(np.asarray(amplitude) > 0.0, allowed / amplitude, np.where(allowed > 0.0, np.inf, 0.0))


def _inverse(used: Array) -> Array:
    with np.errstate(divide="ignore"):
        return np.asarray(1.0 / used)


@dataclass(frozen=True)
class StressCycle:
    """Amplitude and mean of the stress cycles of s points."""

    amplitude: Array  # (s,) von Mises amplitude, Pa
    mean: Array  # (s,) signed von Mises mean, Pa; below 0 in compression
    largest: Array  # (s,) largest von Mises stress of the cycle, Pa


def stress_cycle(harmonics: NDArray[Any]) -> StressCycle:
    """Amplitude and mean of a periodic stress, sigma(t) = sigma_0 + Re sum_h sigma_h exp(i h w t).

    One harmonic is evaluated in closed form but for `largest`, more of them at 64 instants of the period for each
    harmonic: `amplitude` is then within -0.3 % and +0.01 %.

    `harmonics` (H+1, s, 6): components xx, yy, zz, xy, yz, zx of the coefficients, Pa; harmonic 0 real-valued.
    """
    static, moving = np.real(harmonics[0]), np.asarray(harmonics[1:])
    moving = moving[: 1 + max(np.flatnonzero(np.any(moving != 0.0, axis=(1, 2))), default=-1)]
    parts = [np.zeros(static.shape[0]) for _ in range(3)]
    size = max(1, _CHUNK_DOUBLES // (5 * SAMPLES * max(1, len(moving))))
    for first in range(0, static.shape[0], size):
        part = slice(first, first + size)
        for whole, found in zip(parts, _chunk(static[part], moving[:, part]), strict=True):
            whole[part] = found
    return StressCycle(*parts)


def _chunk(static: Array, moving: NDArray[np.complex128]) -> tuple[Array, Array, Array]:
    """Amplitude, mean and largest von Mises stress of a few points."""
    if len(moving) == 0:
        size = von_mises(static)
        return np.zeros(len(static)), _signed(size, static), size
    table = np.exp(2j * np.pi * np.outer(np.arange(SAMPLES * len(moving)) / (SAMPLES * len(moving)), _orders(moving)))
    path = np.real(np.tensordot(table, moving, axes=1))
    largest = von_mises(static + path).max(axis=0)
    if len(moving) == 1:
        amplitude = _half_axis(deviator(moving[0]))
        return amplitude, _signed(von_mises(static), static), largest
    clouds = np.ascontiguousarray(deviator(path).swapaxes(0, 1))
    centre, amplitude = enclosing_balls(clouds, BALL_TOLERANCE)
    pressure = path[..., :3].sum(axis=-1)
    middle = static[:, :3].sum(axis=-1) + 0.5 * (pressure.min(axis=0) + pressure.max(axis=0))
    size = np.linalg.norm(deviator(static) + centre, axis=-1)
    return amplitude, np.where(middle < 0.0, -size, size), largest


def _orders(moving: NDArray[np.complex128]) -> NDArray[np.int64]:
    return np.arange(1, len(moving) + 1)


def _signed(size: Array, stress: Array) -> Array:
    return np.where(stress[..., :3].sum(axis=-1) < 0.0, -size, size)


def _half_axis(ellipse: NDArray[np.complex128]) -> Array:
    """Larger half axis (s,) of the ellipses Re(e exp(i t)) with complex vectors e (s, d)."""
    squared = np.sum(np.abs(ellipse) ** 2, axis=-1)
    return np.sqrt(0.5 * (squared + np.abs(np.sum(ellipse**2, axis=-1))))
