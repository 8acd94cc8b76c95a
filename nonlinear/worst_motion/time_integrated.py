"""What time integration of the ring makes of unstable solutions: where it starts, and what of it is new."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from nonlinear.response_curve import ResponseCurve
from nonlinear.time_integration.ring_motion import RingMotion
from nonlinear.worst_motion.candidates import Place, UnstableStretch, stable_amplitudes

BLADE_PERIODS = 5000  # periods times blades that are integrated for a curve
ONE_START = 3500  # of these for one start: what a large ring takes is left for the others
MOST_FURTHER = 4  # starts after those from the highest points of the unstable stretches
FLOOR = 0.7  # of the highest motion known, below which a ring is not followed
FASTER = 1.5  # ratio of two growths in a period from which the faster one is a start of its own
FALLING = 0.05  # relative fall of a motion that is still falling
SAME_AMPLITUDE = 0.05  # relative difference from a stable solution up to which a periodic motion counts as it

Integrate = Callable[[Place, int, float], RingMotion | None]


@dataclass(frozen=True)
class Departure:
    """What the ring does from an unstable solution.

    Attributes
    ----------
    place : (int, int)
        Branch and index of the solution.
    frequency_hz : float
        Its frequency, Hz.
    motion : RingMotion or None
        The motion that the ring reaches; None where there is none.
    known : bool
        Whether that is a stable solution of the branches.
    falls : bool
        Whether the ring fell below what was worth following, or was still falling at the end.
    failure : str
        Why there is no motion.
    """

    place: Place
    frequency_hz: float
    motion: RingMotion | None
    known: bool = False
    falls: bool = False
    failure: str = ""

    @property
    def new_height(self) -> float:
        """Amplitude of a motion that is no stable solution of the branches, m; 0 otherwise.

        A motion that has not settled may be a transient, which says nothing of what persists: 0 too.
        """
        if self.motion is None or self.known or self.falls or not self.motion.settled:
            return 0.0
        return self.motion.amplitude_m


@dataclass
class DepartureSearch:
    """Time integration from the unstable stretches of a curve.

    Attributes
    ----------
    branches : sequence of ResponseCurve
        Main branch and detached ones.
    integrate : callable
        Integrates the ring from a solution (branch, index), disturbed in its worst pattern, for so many blades times
        periods at most, and as long as it is above a floor, m; None where these do not suffice.
    height_m : float
        Amplitude of the highest motion known, m.
    tolerance : float
        Relative difference of amplitudes up to which a periodic motion counts as a stable solution.
    blade_periods : int
        Blades times periods that are left.
    """

    branches: Sequence[ResponseCurve]
    integrate: Integrate
    height_m: float
    tolerance: float = SAME_AMPLITUDE
    blade_periods: int = BLADE_PERIODS

    def departures(self, stretches: Sequence[UnstableStretch]) -> Iterator[Departure]:
        """From one or two exposed points of each stretch, then from other points of one of them.

        They are the one where perturbations grow fastest and the highest one: the highest motion of a stretch need
        not be where the unstable solution is highest. The stretch is the one that led to the highest motion; else
        the highest one.
        """
        best, chosen, centre = 0.0, 0, -1
        for number, stretch in enumerate(stretches):
            for position in self._first(stretch):
                found = self._departure(stretch, position)
                yield found
                if found.new_height > best:
                    best, chosen, centre = found.new_height, number, position
        if stretches:
            stretch = stretches[chosen]
            yield from self._further(stretch, best, int(stretch.exposed[centre if best else self._top(stretch)]))

    def _further(self, stretch: UnstableStretch, best: float, index: int) -> Iterator[Departure]:
        """From points that halve the gaps in index beside the one with the highest motion; else the largest gaps.

        Low unstable solutions are left alone here, but for the one at `index`.
        """
        heights = self.branches[stretch.branch].amplitude_m[stretch.exposed]
        matters = (heights >= FLOOR * self.height_m) | (stretch.exposed == index)
        stretch = replace(stretch, exposed=stretch.exposed[matters])
        centre = int(np.flatnonzero(stretch.exposed == index)[0])
        tried = [-1, centre, len(stretch.exposed)]
        for _ in range(MOST_FURTHER):
            position = _next(tried, centre if best > 0.0 else None)
            if position is None:
                return
            tried = sorted([*tried, position])
            found = self._departure(stretch, position)
            if found.motion is None and best > 0.0:
                return  # the motion of the stretch is known
            yield found
            if found.motion is None:
                return
            if found.new_height > best:
                best, centre = found.new_height, position

    def _top(self, stretch: UnstableStretch) -> int:
        """Position of the highest point among the exposed ones."""
        return int(np.argmax(self.branches[stretch.branch].amplitude_m[stretch.exposed]))

    def _first(self, stretch: UnstableStretch) -> tuple[int, ...]:
        """Positions of the first starts: the fastest growth of points that are not low, if it is clearly the fastest.

        Then the highest point.
        """
        branch, top = self.branches[stretch.branch], self._top(stretch)
        heights = branch.amplitude_m[stretch.exposed]
        growth = np.nan_to_num(branch.growth_rate[stretch.exposed] / branch.frequency_hz[stretch.exposed])
        fastest = int(np.argmax(np.where(heights >= FLOOR * heights[top], growth, -np.inf)))
        return (fastest, top) if growth[fastest] > FASTER * growth[top] else (top,)

    def _departure(self, stretch: UnstableStretch, position: int) -> Departure:
        place = stretch.branch, int(stretch.exposed[position])
        frequency_hz = float(self.branches[place[0]].frequency_hz[place[1]])
        floor = FLOOR * self.height_m
        try:
            motion = self.integrate(place, min(self.blade_periods, ONE_START), floor)
        except ArithmeticError as error:
            return Departure(place, frequency_hz, None, failure=f"failed: {error}")
        if motion is None:
            return Departure(place, frequency_hz, None, failure="would take too long")
        self.blade_periods -= motion.periods * motion.n_blades
        stable = stable_amplitudes(self.branches, frequency_hz)
        near = np.abs(stable - motion.amplitude_m) <= self.tolerance * stable
        known = motion.periodic and motion.settled and bool(np.any(near))
        return Departure(place, frequency_hz, motion, known, motion.amplitude_m < floor or _falls(motion))


def _falls(motion: RingMotion) -> bool:
    """Whether a motion that has not settled was lower in the last third of the time than in the third before."""
    thirds = np.array_split(motion.envelope_m.max(axis=1), 3)
    return not motion.settled and bool(thirds[2].max() < (1.0 - FALLING) * thirds[1].max())


def _next(tried: Sequence[int], centre: int | None) -> int | None:
    """A position in the larger gap beside `centre`, or in the largest of all; None where there is none.

    `tried` is sorted and holds the positions before the first and after the last one.
    """
    if centre is not None:
        place = list(tried).index(centre)
        tried = tried[place - 1 : place + 2]
    gaps = [(after - before, (before + after) // 2) for before, after in pairwise(tried) if after - before > 1]
    return max(gaps)[1] if gaps else None
