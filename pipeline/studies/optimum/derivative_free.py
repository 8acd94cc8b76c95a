"""Lowest value of a function on the unit cube without derivatives: a coarse search, then SciPy's local methods.

One variable: a grid, then Brent's bounded method around its lowest local minima. Several: a Latin hypercube, then the
simplex method of Nelder and Mead, whose minima may be kinks, from the lowest points.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

Point = tuple[float, ...]
GRID = 9  # points of the grid of one variable
MINIMA = 2  # that are refined
TOLERANCE = 5e-3  # of a variable, as a share of its range
EVALUATIONS = 20  # of a refinement for each variable
WORTH = 1.3  # ratio to the lowest value above which a second start is not refined
APART = 0.25  # of a second start from the first, in the unit cube
_DIGITS = 6  # of a share of the range, by which points are known again


@dataclass
class UnitSearch:
    """Values of a function on the unit cube, each computed once, and its minimum."""

    # gives the values at a list of points of the unit cube; infinity where there is none
    function: Callable[[Sequence[Point]], Sequence[float]]
    size: int  # number of variables
    grid: int = GRID  # points of the grid of one variable
    evaluations: int = EVALUATIONS  # largest number of evaluations of a refinement for each variable
    known: dict[Point, float] = field(default_factory=dict)

    def minimise(self, first: Sequence[Point] = ()) -> Point | None:
        """The lowest point found; None where the function has no value at any of the first points."""
        self._evaluate([*(_rounded(point) for point in first), *(self._grid() if self.size == 1 else self._sample())])
        if not any(map(math.isfinite, self.known.values())):
            return None
        if self.size == 1:
            for bracket in self._brackets():
                self._brent(bracket)
        else:
            for start in self._starts():
                self._simplex(start)
        return min(self.known, key=self.known.__getitem__)

    @property
    def spread(self) -> float:
        """Largest over smallest value found, less 1."""
        finite = [value for value in self.known.values() if math.isfinite(value)]
        return max(finite) / min(finite) - 1.0 if finite and min(finite) > 0.0 else math.inf

    def _grid(self) -> list[Point]:
        return [_rounded((float(share),)) for share in np.linspace(0.0, 1.0, self.grid)]

    def _sample(self) -> list[Point]:
        from scipy.stats import qmc

        count = 4 * self.size + 4
        unit = qmc.LatinHypercube(self.size, rng=np.random.default_rng(0), optimization="random-cd").random(count)
        return [(0.5,) * self.size, *(_rounded(row) for row in unit.tolist())]

    def _evaluate(self, points: Sequence[Point]) -> None:
        missing = [point for point in dict.fromkeys(points) if point not in self.known]
        if missing:
            self.known |= dict(zip(missing, self.function(missing), strict=True))

    def _at(self, point: Sequence[float]) -> float:
        """The value at a point; where there is none, one above all others."""
        place = _rounded([min(max(share, 0.0), 1.0) for share in point])
        self._evaluate([place])
        value = self.known[place]
        return value if math.isfinite(value) else 2.0 * max(filter(math.isfinite, self.known.values()))

    def _brackets(self) -> list[tuple[float, float]]:
        """Intervals around the lowest local minima, the lowest first."""
        shares = sorted(point[0] for point in self.known)
        heights = [self.known[(share,)] for share in shares]
        found = []
        for k in range(len(shares)):
            beside = [heights[j] for j in (k - 1, k + 1) if 0 <= j < len(shares)]
            if math.isfinite(heights[k]) and heights[k] <= min(beside):
                found.append((heights[k], shares[max(k - 1, 0)], shares[min(k + 1, len(shares) - 1)]))
        return [(left, right) for _, left, right in sorted(found)[:MINIMA]]

    def _brent(self, bracket: tuple[float, float]) -> None:
        from scipy.optimize import minimize_scalar

        options = {"xatol": TOLERANCE, "maxiter": self.evaluations}
        minimize_scalar(lambda share: self._at([share]), bounds=bracket, method="bounded", options=options)

    def _starts(self) -> list[Point]:
        """The lowest point, and the lowest one apart from it that is not much higher."""
        ordered = sorted(self.known, key=self.known.__getitem__)
        best = ordered[0]
        apart = [point for point in ordered if max(abs(a - b) for a, b in zip(point, best, strict=True)) > APART]
        second = [point for point in apart[:1] if self.known[point] <= WORTH * self.known[best]]
        return [best, *second]

    def _simplex(self, start: Point) -> None:
        from scipy.optimize import minimize

        corners = np.tile(np.array(start), (self.size + 1, 1))
        for k, share in enumerate(start):
            corners[k + 1, k] += -0.15 if share > 0.5 else 0.15
        options = {
            "initial_simplex": corners,
            "xatol": TOLERANCE,
            "fatol": math.inf,
            "maxfev": self.evaluations * self.size,
        }
        minimize(self._at, start, method="Nelder-Mead", bounds=[(0.0, 1.0)] * self.size, options=options)


def _rounded(point: Sequence[float]) -> Point:
    return tuple(round(float(share), _DIGITS) for share in point)
