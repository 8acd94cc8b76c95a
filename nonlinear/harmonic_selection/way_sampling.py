"""Points on the way to a peak solved with more harmonics, as far as they lie on one branch without doubt.

A branch with more harmonics is a shifted copy of the branch with few, until it parts from it. Where the shift is
known at both ends of a part of the way, and in its middle is what these two let expect, no step between needs to be
solved.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from nonlinear.continuation.solution_point import SolutionPoint, Tangent
from nonlinear.harmonic_balance.truncated_balances import pad_or_truncate

LONGEST_PART = 8  # points of the longest part of the way that is checked at its ends and in its middle only
SAME_SHIFT = 0.25  # distance from the expected shift, relative to the step of the branch there, that is none
SAME_DIRECTION = 0.5  # the same relative to the shift: beyond a resonance of the added harmonics it is reversed
NEGLIGIBLE_SHIFT = 1e-4  # relative to the vibration
SHORTEST_PART = 2  # points

Refit = Callable[[SolutionPoint, Tangent | None], SolutionPoint | None]


@dataclass
class WaySampling:
    """The branch with more harmonics at points of the way, solved where it is asked for."""

    # the way with few harmonics, from its start to the peak; tangents towards the peak
    points: Sequence[SolutionPoint]
    # the solution with more harmonics in the normal plane of a point, from a shift on; None if it is not found
    refit: Refit
    _solved: dict[int, SolutionPoint | None] = field(default_factory=dict, init=False, repr=False)

    @property
    def last(self) -> int:
        """Place of the peak."""
        return len(self.points) - 1

    def solved_up_to(self, place: int) -> list[SolutionPoint]:
        """The solutions so far, up to a place, in the order of the way."""
        found = (self._solved[each] for each in sorted(self._solved) if each <= place)
        return [solution for solution in found if solution is not None]

    def solution(self, place: int, like: Tangent | None = None) -> SolutionPoint | None:
        """The solution with more harmonics at a place; None if it is not found. `like`: the shift to start from."""
        if place not in self._solved:
            self._solved[place] = self.refit(self.points[place], like)
        return self._solved[place]

    def reached_from(self, start: int) -> int:
        """The last place that lies on the branch of the solution at `start` without doubt.

        A part of the way is halved until the shift in its middle is the mean of those at its ends. The sign of the
        bordered determinant is constant along a branch; where it changes between two solutions, they lie on two
        branches.
        """
        n_parts = max(1, round((self.last - start) / LONGEST_PART))
        ends = np.linspace(start, self.last, n_parts + 1).astype(int).tolist()
        reached, parts = start, list(pairwise(ends))[::-1]
        while parts:
            first, after = parts.pop()
            if self._certain(first, after):
                reached = after
            elif after - first < 2 * SHORTEST_PART:
                break
            else:
                middle = (first + after) // 2
                parts += [(middle, after), (first, middle)]
        return reached

    def _certain(self, first: int, after: int) -> bool:
        """Whether the solutions at both ends of a part lie on one branch without doubt."""
        if self.solution(first) is None:
            return False
        self.solution(after, self._shift(first))
        if not self._on_one_branch(first, after):
            return False
        return after - first > 1 and self._as_expected(first, (first + after) // 2, after)

    def targets_beyond(self, place: int) -> dict[int, SolutionPoint]:
        """Some solutions beyond a place, by their places: 2, 8, 32, ... points farther on, and the last one."""
        places = [place + 2**power for power in range(1, 16, 2) if place + 2**power < self.last]
        found = {each: self.solution(each) for each in (*places, self.last)}
        return {each: solution for each, solution in found.items() if solution is not None}

    def _on_one_branch(self, first: int, after: int) -> bool:
        """Whether both are found, with one sign of the bordered determinant."""
        one, other = self.solution(first), self.solution(after)
        return one is not None and other is not None and one.bordered_sign == other.bordered_sign

    def _as_expected(self, first: int, middle: int, after: int) -> bool:
        """Whether the shift in the middle is interpolated between the ends, relative to the steps of the branch."""
        to_middle, whole = (abs(self.points[place].arc - self.points[first].arc) for place in (middle, after))
        share = to_middle / whole if whole > 0.0 else 0.5
        (x_first, omega_first), (x_after, omega_after) = self._shift(first), self._shift(after)
        expected = (1.0 - share) * x_first + share * x_after, (1.0 - share) * omega_first + share * omega_after
        self.solution(middle, expected)
        if not (self._on_one_branch(first, middle) and self._on_one_branch(middle, after)):
            return False
        metric, found = self.points[middle].metric, self._shift(middle)
        error = metric.norm(found[0] - expected[0], found[1] - expected[1])
        step = max(abs(self.points[middle + side].arc - self.points[middle].arc) for side in (-1, 1))
        shift = max(metric.norm(*each) for each in (found, self._shift(first), self._shift(after)))
        return error <= NEGLIGIBLE_SHIFT or error <= min(SAME_SHIFT * step, SAME_DIRECTION * shift)

    def _shift(self, place: int) -> Tangent:
        point, solution = self.points[place], self.solution(place)
        assert solution is not None
        return solution.unknown - pad_or_truncate(point.unknown, solution.balance), solution.omega - point.omega
