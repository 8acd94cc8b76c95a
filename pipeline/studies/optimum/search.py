"""Searches without derivatives: each value of a function is computed once, infinity where there is none.

Of one variable by bounds: between computed values the function is at least as high as its neighbouring secants,
extended, say (`bound_between`).

`UnitSearch`: of one variable on a grid, then where the bound is lowest; of several at places that fill the ranges
evenly, then by the simplex method of Nelder and Mead, whose minima may be kinks, from the lowest points.

`WindowSearch`: the lowest of the highest values within a window around one variable. The window with the lowest bound
is the next to be refined, until there is nothing left to refine in it. It begins with values as far apart as the
window is wide; with an expected best value only around that, and further out at distances that double, where the
bounds tell whether there may be something lower.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from nonlinear.peak_curves.peak_search import quasi_random
from nonlinear.peak_curves.worst_envelope import bound_between, range_below

Array = NDArray[np.float64]
Point = tuple[float, ...]
GRID = 9  # points of the grid of one variable
TOLERANCE = 5e-3  # of a variable, as a share of its range
EVALUATIONS = 20  # of a refinement for each variable, at most
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
    tolerance: float = TOLERANCE  # of a variable, as a share of its range
    gain: float = 0.0  # least relative gain that is worth a further value of one variable
    known: dict[Point, float] = field(default_factory=dict)

    def minimise(self, first: Sequence[Point] = ()) -> Point | None:
        """The lowest point found; None where the function has no value at any of the first points."""
        self._evaluate([*(_rounded(point) for point in first), *(self._grid() if self.size == 1 else self._sample())])
        if not any(map(math.isfinite, self.known.values())):
            return None
        if self.size == 1:
            self._by_bounds()
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
        return [(0.5,) * self.size, *(_rounded(place) for place in quasi_random(self.size, 4 * self.size + 4))]

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

    def _by_bounds(self) -> None:
        """Where secants leave room for the lowest value, the next one, until the gain or the room is too small."""
        shares = np.linspace(0.0, 1.0, round(2.0 / self.tolerance) + 1)
        for _ in range(self.evaluations):
            known = np.array(sorted(point[0] for point in self.known))
            bound = bound_between(known, np.array([self._at((share,)) for share in known]), shares)
            bound[np.abs(shares[:, None] - known).min(axis=1) < 0.999 * self.tolerance] = math.inf
            if not bound.min() < (1.0 - self.gain) * min(self.known.values()):
                return
            lowest = float(np.median(shares[bound == bound.min()]))
            start, end = known[known < lowest].max(), known[known > lowest].min()
            room = 0.25 * (end - start)  # a value beside a known one tells little
            self._at((min(max(lowest, start + room), end - room),))

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
            "xatol": self.tolerance,
            "fatol": math.inf,
            "maxfev": self.evaluations * self.size,
        }
        minimize(self._at, start, method="Nelder-Mead", bounds=[(0.0, 1.0)] * self.size, options=options)


def _written(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def _rounded(point: Iterable[float]) -> Point:
    return tuple(round(float(share), _DIGITS) for share in point)


STEPS = 100  # places in a tolerance at which windows are compared
FINEST, COARSE = 0.1, 0.5  # widths of intervals, by the tolerance: not refined, always refined
STRAIGHT = 0.02  # relative room between chord and bound that counts as none
LOW = 0.7  # of the highest in a window: intervals that end below need not be straight
STEEP = 1.25  # ratio of a value just outside a window to the highest inside above which that is told
CHECKS, AGREED = 5, 0.003  # of a window by the values at its ends, and the relative change that ends them
FIRST = 9, 17  # fewest and most values of the first grid
FLAT, ALIKE = 1e-3, 0.03  # relative differences that count as none: of the whole range, of the ends of a window
CENTRE = 1e-3  # relative difference of windows that counts as none: the middle one is taken
DIGITS = 12  # of values


@dataclass
class WindowSearch:
    """The variable around which the highest value of a function within a tolerance is lowest, or a quantile of it."""

    # heights at each of some values: those of several cases, all of which count
    function: Callable[[Sequence[float]], Sequence[Sequence[float]]]
    low: float
    high: float  # the range of the variable
    tolerance: float  # half width of the window, or of that in which most of the `shifts` lie
    shifts: Array | None = None  # equally likely deviations, rising, of which a quantile counts; None: the highest
    level: float = 1.0  # the quantile
    most: int = 80  # values at most
    enough: float = math.inf  # a bound above which no best value is worth refining
    close: float = 0.0  # relative distance of the lowest value found from its bound that is not worth refining
    expected: float | None = None  # around which the first values are dense; None: over the whole range
    known: dict[float, tuple[float, ...]] = field(default_factory=dict)
    checked: dict[float, float] = field(default_factory=dict)  # windows whose ends and middle are known

    def __post_init__(self) -> None:
        self.step = self.tolerance / STEPS
        own = np.array([-self.tolerance, self.tolerance]) if self.shifts is None else self.shifts
        self.places = np.rint(own / self.step).astype(int)  # of the shifts, in steps
        count = int((self.high - self.low) / self.step * (1.0 + 1e-12)) + 1
        self.centres = self.low + self.step * np.arange(count, dtype=np.float64)
        before, after = -min(self.places[0], 0), max(self.places[-1], 0)
        self.grid = self.low + self.step * np.arange(-before, count + after)
        self._tried: list[float] = []  # the windows that were found best
        self._limit = math.inf

    def minimise(self) -> float | None:
        """The best value of the variable; None where the function has no value."""
        self._evaluate(self._first_values())
        if not any(math.isfinite(max(heights)) for heights in self.known.values()):
            return None
        for _ in range(CHECKS):
            self._refine()
            value, predicted = self.lowest()
            if predicted > self.enough:
                return self.lowest(hopeful=False)[0]
            if self.close:
                value, predicted = self.lowest(hopeful=False)
            found = self.check(value)
            self._tried.append(value)
            if abs(found - predicted) <= max(AGREED, self.close) * predicted or self.exhausted:
                break
        return self.best()

    def _first_values(self) -> list[float]:
        """Values to begin with, to both ends of the range; without an expected one also between those known."""
        ends = float(self.grid[0]), float(self.grid[-1])
        if self.expected is None:
            count = min(max(math.ceil((ends[1] - ends[0]) / self.tolerance), FIRST[0] - 1), FIRST[1] - 1)
            each = (ends[1] - ends[0]) / count
            places = sorted({*ends, *self.known})
            counts = [max(round((end - start) / each), 1) for start, end in pairwise(places)]
            parts = [np.linspace(*pair, n + 1) for pair, n in zip(pairwise(places), counts, strict=True)]
            return np.concatenate(parts).tolist()
        count = math.ceil(math.log2((ends[1] - ends[0]) / self.tolerance + 2.0))
        away = self.tolerance * (2.0 ** np.arange(1, count + 1) - 1.0)  # 1, 3, 7, ... tolerances
        values = np.unique([self.expected - away, self.expected + away])
        room = self.tolerance if self.shifts is None else 0.5 * self.tolerance
        inside = (values > ends[0] + room) & (values < ends[1] - room)
        return [ends[0], *values[inside].tolist(), ends[1]]

    @property
    def covered(self) -> bool:
        """Whether values are known on both sides of every window."""
        slack = 0.1 * self.step
        return bool(self.known) and min(self.known) < self.grid[0] + slack and max(self.known) > self.grid[-1] - slack

    @property
    def exhausted(self) -> bool:
        """Whether the search ended with intervals that it wanted to refine."""
        return len(self.known) >= self.most

    def heights_of(self, hopeful: bool = False) -> Array:
        """What is made low at each of `centres`; hopeful: what it is at least."""
        curves = np.array([self._between(case, hopeful) for case in np.array(self._heights()).T])
        if self.shifts is None:
            from scipy.ndimage import maximum_filter1d

            reach = int(self.places[-1])
            return maximum_filter1d(curves.max(axis=0), 2 * reach + 1)[reach : reach + len(self.centres)]
        first = self.places - min(int(self.places[0]), 0)
        parts = np.array_split(np.arange(len(self.centres)), max(len(self.centres) // 500, 1))
        found = [np.quantile(curves[:, part[:, None] + first], self.level, axis=(0, 2)) for part in parts]
        return np.concatenate(found)

    def lowest(self, hopeful: bool = True) -> tuple[float, float]:
        """The value of the variable with the lowest bound, the middle one of nearly equal ones, and that bound."""
        heights = self.heights_of(hopeful)
        best = int(heights.argmin())
        near = heights <= heights[best] * (1.0 + CENTRE)
        others = np.flatnonzero(~near)
        left, right = others[others < best], others[others > best]
        ends = int(left[-1]) + 1 if left.size else 0, int(right[0]) - 1 if right.size else len(near) - 1
        best = sum(ends) // 2
        return _written(self.centres[best]), float(heights[best])

    def best(self) -> float:
        """The best value of the variable so far, between known values where its window is not checked."""
        own = [value for value in self.checked if value in self._tried]
        return min(own, key=self.checked.__getitem__) if own else self.lowest(hopeful=False)[0]

    def bracket(self, height: float) -> tuple[float, float]:
        """Ends of the values of the variable that may be as low as a height."""
        heights = self.heights_of(hopeful=True)
        chosen = self.centres[heights <= max(height, float(heights.min())) * (1.0 + AGREED)]
        return max(float(chosen[0]) - self.step, self.low), min(float(chosen[-1]) + self.step, self.high)

    def around(self, height: float) -> tuple[float, float]:
        """Ends of the values of the variable around the best one that are not higher."""
        return range_below(self.centres, self.heights_of(), self.best(), height)

    def kind(self) -> str:
        """What decides the best value: flat, edge, steep, balanced, inside or, where nothing of this, sampled."""
        best, heights = self.best(), self.heights_of()
        if heights.max() < (1.0 + FLAT) * heights.min():
            return "flat"
        if min(best - self.low, self.high - best) <= self.step:
            return "edge"
        if self.shifts is not None or best not in self.checked:
            return "sampled"
        inside = self.inside(best)
        reach = FINEST * self.tolerance * (1.0 + 1e-6)
        beside = [value for value in self.known if 0.0 < max(inside[0] - value, value - inside[-1]) <= reach]
        first, last, most = (max(self.known[value]) for value in (inside[0], inside[-1], max(inside, key=self._at)))
        if any(max(self.known[value]) > STEEP * most for value in beside):
            return "steep"
        if max(first, last) < (1.0 - ALIKE) * most:
            return "inside"
        return "balanced" if min(first, last) >= (1.0 - ALIKE) * most else "sampled"

    def _at(self, value: float) -> float:
        return max(self.known[value])

    def value_at(self, centre: float) -> float:
        """What is made low around a value of the variable, between the values known."""
        return float(np.interp(centre, self.centres, self.heights_of()))

    def inside(self, centre: float) -> list[float]:
        """The values known in the window around a value of the variable."""
        ends = centre + self.places[[0, -1]] * self.step
        slack = 0.1 * self.step
        return [value for value in sorted(self.known) if ends[0] - slack <= value <= ends[1] + slack]

    def _heights(self) -> list[tuple[float, ...]]:
        """Heights of the known values in their order; one above all others where there is none."""
        finite = [height for row in self.known.values() for height in row if math.isfinite(height)]
        none = 10.0 * max(finite, default=1.0)
        return [tuple(h if math.isfinite(h) else none for h in self.known[value]) for value in sorted(self.known)]

    def _between(self, heights: Array, hopeful: bool) -> Array:
        """Heights of one case on the grid, between the known values."""
        values = np.array(sorted(self.known))
        linear = np.interp(self.grid, values, heights)
        if not hopeful:
            return linear
        place = np.clip(np.searchsorted(values, self.grid, side="right") - 1, 0, len(values) - 2)
        apart = np.minimum(self.grid - values[place], values[place + 1] - self.grid) > 1e-6 * self.step
        return np.where(apart & self._open()[place], bound_between(values, heights, self.grid), linear)

    def _open(self) -> NDArray[np.bool_]:
        """Whether there may be more between two neighbouring known values than the chord tells, for each pair."""
        values, heights = np.array(sorted(self.known)), np.array(self._heights())
        width = np.diff(values) / self.tolerance * (1.0 - 1e-9)
        middles, chords = 0.5 * (values[1:] + values[:-1]), 0.5 * (heights[1:] + heights[:-1])
        bounds = np.transpose([bound_between(values, case, middles) for case in heights.T])
        room = (1.0 - bounds / chords).max(axis=1)
        highest = np.maximum(heights[1:], heights[:-1]).max(axis=1)
        return (width > COARSE) | (width > FINEST) & (room > STRAIGHT) & (highest > LOW * self._limit)

    def _refine(self) -> None:
        """Halve the open intervals of the window with the lowest bound, until it has none."""
        while not self.exhausted:
            centre, self._limit = self.lowest()
            if self._limit > self.enough:
                return
            if self.close and self.lowest(hopeful=False)[1] <= self._limit * (1.0 + self.close):
                return
            ends = centre + self.places[[0, -1]] * self.step
            middles = [
                0.5 * (start + end)
                for (start, end), is_open in zip(pairwise(sorted(self.known)), self._open(), strict=True)
                if end > ends[0] and start < ends[1] and is_open
            ]
            if not middles:
                return
            self._evaluate(middles)

    def check(self, centre: float) -> float:
        """What is made low around a value of the variable, with its middle and, of the highest, its ends."""
        sides = (0.0,) if self.shifts is not None else (-self.tolerance, 0.0, self.tolerance)
        self._evaluate([centre + side for side in sides])
        if self.shifts is None:
            self.checked[centre] = max(max(self.known[value]) for value in self.inside(centre))
        else:
            self.checked[centre] = self.value_at(centre)
        return self.checked[centre]

    def _evaluate(self, values: Sequence[float]) -> None:
        """Compute the heights at some values."""
        missing = [value for value in dict.fromkeys(map(_written, values)) if value not in self.known]
        if missing:
            self.known |= dict(zip(missing, map(tuple, self.function(missing)), strict=True))
