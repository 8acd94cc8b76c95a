"""A bracket around a zero of a function of one variable, closed by interpolation and bisection.

`scipy.optimize` has the same method. It takes as long to load as a curve with one harmonic takes to solve, in every
worker process.

References
----------
T. R. Chandrupatla, A new hybrid quadratic/bisection algorithm for finding the zero of a nonlinear function without
using derivatives, Advances in Engineering Software 28, 1997, pp. 145-149.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

MOST_EVALUATIONS = 200


class ZeroBracket(NamedTuple):
    """Two sides of a zero, the one found last first, and the one that this has replaced: place and value of each.

    At first the order does not matter. Interpolation and bisection alternate as Chandrupatla (1997) says. A place is
    an arc length, a frequency or a part of a step.
    """

    newest: tuple[float, float]
    other: tuple[float, float]
    replaced: tuple[float, float] | None = None

    @property
    def width(self) -> float:
        """Distance between the two sides."""
        return abs(self.other[0] - self.newest[0])

    def narrowed(self, place: float, value: float, beyond: bool) -> ZeroBracket:
        """The bracket with a side at `place`: the higher one, if it is `beyond` the zero."""
        if (self.newest[0] > self.other[0]) == beyond:
            return ZeroBracket((place, value), self.other, self.newest)
        return ZeroBracket((place, value), self.newest, self.other)

    def next_place(self, resolution: float) -> float:
        """Where to look next, no nearer to a side than `resolution`."""
        shortest = min(resolution / self.width, 0.5) if self.width > 0.0 else 0.5
        share = min(max(self._share(), shortest), 1.0 - shortest)
        return self.newest[0] + share * (self.other[0] - self.newest[0])

    def zero_of_derivative(self, rise: float) -> float:
        """Zero of a function that is quadratic and has the integral `rise` over the bracket."""
        (start, first), (end, last) = self.newest, self.other
        width = end - start
        curvature = 6.0 * (0.5 * (first + last) * width - rise) / width**3
        slope = (last - first) / width - curvature * width
        root = math.sqrt(max(slope**2 - 4.0 * curvature * first, 0.0))
        place = start - 2.0 * first / (slope - math.copysign(root, first))
        return place if min(start, end) < place < max(start, end) else self.next_place(0.0)

    def _share(self) -> float:
        """Part of the way from the newest side to the other one: by a secant, then a parabola or to the middle.

        The parabola is that of the place over the value, where it is monotonic.
        """
        (a, value_a), (b, value_b) = self.newest, self.other
        if not value_a * value_b < 0.0:
            return 0.5
        if self.replaced is None:
            return value_a / (value_a - value_b)
        c, value_c = self.replaced
        part, drop = (a - b) / (c - b), (value_a - value_b) / (value_c - value_b)
        if not (drop**2 < part and (1.0 - drop) ** 2 < 1.0 - part):  # nor with a NaN
            return 0.5
        secant = value_a / (value_b - value_a) * value_c / (value_b - value_c)
        return secant + (c - a) / (b - a) * value_a / (value_c - value_a) * value_b / (value_c - value_b)


def closed_bracket(
    function: Callable[[float], float], first: tuple[float, float], last: tuple[float, float], width: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Narrow a bracket around a zero to a given width."""
    bracket, sign, upward = ZeroBracket(first, last), math.copysign(1.0, first[1]), last[0] > first[0]
    for _ in range(MOST_EVALUATIONS):
        if bracket.width <= width or bracket.newest[1] == 0.0:
            break
        place = bracket.next_place(0.5 * width)
        value = function(place)
        bracket = bracket.narrowed(place, value, (sign * value < 0.0) == upward)
    sides = sorted((bracket.newest, bracket.other), key=lambda side: side[0], reverse=not upward)
    return sides[0], sides[1]
