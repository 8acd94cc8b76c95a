"""What time integration of the ring makes of unstable solutions: where it starts, and what of it is new."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from nonlinear.response_curve import ResponseCurve
from nonlinear.time_integration.ring_motion import RingMotion
from nonlinear.worst_motion.candidates import Place, UnstableStretch, stable_amplitudes

BLADE_PERIODS = 3000  # periods times blades that are integrated for a curve
MOST_REFINEMENTS = 4  # starts beside the one that led to the highest motion
WORTH_REFINING = 0.7  # of the highest motion known, from which the highest of a stretch is sought
SAME_AMPLITUDE = 0.05  # relative difference from a stable solution up to which a periodic motion counts as it

Integrate = Callable[[Place, int], RingMotion | None]


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
    failure : str
        Why there is none.
    """

    place: Place
    frequency_hz: float
    motion: RingMotion | None
    known: bool = False
    failure: str = ""

    @property
    def new_height(self) -> float:
        """Amplitude of a motion that is no stable solution of the branches, m; 0 otherwise."""
        return 0.0 if self.motion is None or self.known else self.motion.amplitude_m


@dataclass
class DepartureSearch:
    """Time integration from the unstable stretches of a curve.

    Attributes
    ----------
    branches : sequence of ResponseCurve
        Main branch and detached ones.
    integrate : callable
        Integrates the ring from a solution, disturbed in its worst pattern, for so many blades times periods at most;
        None where these do not suffice.
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
        """From the highest exposed point of each stretch, then from points beside the one with the highest motion."""
        best, found_in = 0.0, -1
        for number, stretch in enumerate(stretches):
            top = self._top(stretch)
            found = self._departure(stretch, top)
            yield found
            if found.new_height > best:
                best, found_in = found.new_height, number
        if best > WORTH_REFINING * self.height_m:
            yield from self._refined(stretches[found_in], best)

    def _refined(self, stretch: UnstableStretch, best: float) -> Iterator[Departure]:
        """From points between those tried: the highest motion of a stretch need not lie at its highest point.

        They halve the gaps in index on both sides of the point that led to the highest motion so far.
        """
        centre = self._top(stretch)
        tried = [-1, centre, len(stretch.exposed)]
        for _ in range(MOST_REFINEMENTS // 2):
            for position in _beside(tried, centre):
                tried = sorted([*tried, position])
                found = self._departure(stretch, position)
                if found.motion is None:
                    continue  # the stretch itself was integrated
                yield found
                if found.new_height > best:
                    best, centre = found.new_height, position

    def _top(self, stretch: UnstableStretch) -> int:
        """Position of the highest point among the exposed ones."""
        return int(np.argmax(self.branches[stretch.branch].amplitude_m[stretch.exposed]))

    def _departure(self, stretch: UnstableStretch, position: int) -> Departure:
        place = stretch.branch, int(stretch.exposed[position])
        frequency_hz = float(self.branches[place[0]].frequency_hz[place[1]])
        try:
            motion = self.integrate(place, self.blade_periods)
        except ArithmeticError as error:
            return Departure(place, frequency_hz, None, failure=f"failed: {error}")
        if motion is None:
            return Departure(place, frequency_hz, None, failure="would take too long")
        self.blade_periods -= motion.periods * motion.n_blades
        stable = stable_amplitudes(self.branches, frequency_hz)
        near = np.abs(stable - motion.amplitude_m) <= self.tolerance * stable
        return Departure(place, frequency_hz, motion, motion.periodic and motion.settled and bool(np.any(near)))


def _beside(tried: list[int], centre: int) -> list[int]:
    """Positions half way from `centre` to its tried neighbours; `tried` is sorted and holds both ends outside."""
    at = tried.index(centre)
    halves = ((tried[at - 1] + centre) // 2, (centre + tried[at + 1] + 1) // 2)
    return [position for position in halves if tried[at - 1] < position < tried[at + 1] and position != centre]
