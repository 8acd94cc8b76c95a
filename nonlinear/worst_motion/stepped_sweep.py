"""Stepped frequency sweep of a motion in time: from step to step the ring starts in the state that it has reached.

A motion is followed both ways until its height drops, the step halved there. Where it is highest it has to persist:
as a stable point of a branch of several blades (`ring_branch`), else in time.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from nonlinear.contact.parameters import Array
from nonlinear.time_integration.ring import RingState
from nonlinear.time_integration.ring_motion import KEEPS, RingMotion
from nonlinear.worst_motion.ring_branch import ring_branch
from nonlinear.worst_motion.ring_integration import CONFIRMATION, FLOOR, LONGER, MOST_BLADES, RingIntegration, counts

FIRST_STEP, LARGEST_STEP, SMALLEST_STEP = 3e-3, 6e-3, 4e-4  # relative to the frequency
LONGER_STEP = 1.4  # factor on a step after one that kept the motion
NEAR = 0.9  # of the highest point of a sweep, below which steps may be twice as large
SETTLING, STEP_WINDOW = 12, 28  # periods of a step before its window, and of that
FIRST_WAY = 0.75  # share of the periods times blades for the way in which the motion gets higher
RISING = 1.5  # the same for either way as long as the motion gets higher
KEPT = 2.0  # confirmations that periods are kept for
LOW = 0.5  # of the highest point of a sweep, below which it ends
SAME_TOP = 0.02  # of a branch, by which coarse steps are above it at most
MOST_TOPS = 3  # highest points that are integrated for longer, until no other was higher


@dataclass(frozen=True)
class Sweep:
    """A motion over a range of frequencies."""

    frequency_hz: Array  # (P,), rising
    amplitude_m: Array  # (P,), largest displacement of the window of a step
    top_hz: float  # frequency of the highest motion that persists
    top: RingMotion | None  # that motion; None where none of the highest points persists
    blade_periods: int  # integrated
    complete: bool  # whether the motion was followed both ways to where it is lost or clearly lower, or is low
    truncation_error: float = 0.0  # estimated, of the highest motion; 0 where that is one of time integration
    seen_m: float = 0.0  # largest displacement where it was confirmed, whether it persists or not

    @property
    def solved(self) -> bool:
        """Whether the highest motion is one of harmonic balance of several blades."""
        return self.truncation_error > 0.0


@dataclass
class SteppedSweep:
    """Follows motions of one curve in frequency."""

    integration: RingIntegration

    def __call__(self, frequency_hz: float, motion: RingMotion, blade_periods: int, height_m: float) -> Sweep:
        """Follow a motion both ways with at most so many blades times periods, and confirm it where it is highest.

        A periodic motion of several blades is followed by harmonic balance instead: with no periods this alone.
        `height_m`: of the highest motion known, m; points below it are not confirmed.
        """
        walk = _Walk(self.integration, motion, frequency_hz)
        solved = walk.branch(frequency_hz, motion, height_m)
        if solved is None and blade_periods > 0:
            walk, blade_periods = walk.calm(height_m, blade_periods)
            another = blade_periods > 0 and walk.start is not motion
            solved = walk.branch(frequency_hz, walk.start, height_m) if another else None
        if solved is not None or blade_periods <= 0:
            top_hz, top, error = solved or (math.nan, None, 0.0)
            places = sorted(walk.points)
            heights = np.array([walk.points[place][0] for place in places])
            return Sweep(np.array(places), heights, top_hz, top, walk.spent, True, error)
        way = 1.0 if walk.rises() else -1.0
        most = max(blade_periods - round(KEPT * CONFIRMATION * LONGER * walk.start.n_blades), blade_periods // 2)
        rising = round(RISING * most)
        complete = walk.go(way, round(FIRST_WAY * most), rising)
        complete &= walk.go(-way, most, rising)
        top_hz, top, error = walk.top(height_m)
        places = sorted(set(walk.points) - set(walk.lost if top is not None else ()))
        heights = np.array([walk.points[place][0] for place in places])
        if top is not None:
            heights = np.minimum(heights, top.amplitude_m)  # above it are bursts of a short window
        return Sweep(np.array(places), heights, top_hz, top, walk.spent, complete, error, walk.seen_m)


@dataclass
class _Walk:
    """A sweep as it goes."""

    integration: RingIntegration
    start: RingMotion
    start_hz: float
    points: dict[float, tuple[float, RingState]] = field(default_factory=dict)  # height and state by frequency
    spent: int = 0
    lost: list[float] = field(default_factory=list)  # frequencies at which the motion does not persist
    seen_m: float = 0.0  # largest displacement where it was confirmed

    def __post_init__(self) -> None:
        """The first point."""
        self.points[self.start_hz] = self.start.amplitude_m, self.start.final

    def calm(self, height_m: float, blade_periods: int) -> "tuple[_Walk, int]":
        """The sweep of what becomes of its motion after some time, and the periods for it: none where it is low.

        One of few blades that has kept its height for so long is swept as it is: of many, a transient costs too much.
        """
        kept = self.start.persistence >= LONGER and self.start.n_blades <= MOST_BLADES
        as_it_is = self.start.amplitude_m, self.start_hz, self.start
        found = as_it_is if kept else self._followed_on(self.start_hz)
        if found is None:
            return self, blade_periods
        if found[0] < FLOOR * height_m:
            return self, 0
        return replace(self, start=found[2], points={}, lost=[]), max(blade_periods - self.spent, 1)

    @property
    def highest(self) -> float:
        """The largest height so far, m."""
        return max(height for height, _ in self.points.values())

    def rises(self) -> bool:
        """Whether the motion is higher after a step to a higher frequency."""
        place = self.start_hz + FIRST_STEP * self.start_hz
        found = self._step(place, self.start.final) if place <= self.integration.options.frequency_hz[1] else None
        if found is None or found[0] < self.start.amplitude_m:
            return False
        self.points[place] = found
        return True

    def go(self, sign: float, most: int, most_rising: int) -> bool:
        """Step one way until the motion is lost or low or the range ends, or `most` is spent.

        `most_rising`: the same while the motion gets higher. False: it was spent where the motion is nearly highest.
        """
        at, step = self.start_hz, FIRST_STEP
        while step >= SMALLEST_STEP:
            height, state = self.points[at]
            place = at + sign * step * self.start_hz
            low, high = self.integration.options.frequency_hz
            if height < LOW * self.highest or not low <= place <= high:
                return True
            if self.spent >= (most if height < self.highest else most_rising):
                return height < NEAR * self.highest
            found = self.points.get(place) or self._step(place, state)
            if found is None or found[0] < KEEPS * height:
                step *= 0.5
                continue
            self.points[place], at = found, place
            longest = LARGEST_STEP if found[0] > NEAR * self.highest else 2.0 * LARGEST_STEP
            step = min(LONGER_STEP * step, longest)
        return True

    def _step(self, frequency_hz: float, state: RingState) -> tuple[float, RingState] | None:
        """Height and state after a step to a frequency; None where the time integration fails."""
        self.spent += (SETTLING + STEP_WINDOW) * self.start.n_blades
        omega = 2.0 * math.pi * frequency_hz
        try:
            integrator = self.integration.coarse(omega, self.integration.pattern_of(self.start))
            record = integrator.march(state, SETTLING + STEP_WINDOW)
        except ArithmeticError:
            return None
        return float(record.envelope_m[SETTLING:].max()), record.final

    def top(self, height_m: float) -> tuple[float, RingMotion | None, float]:
        """The highest motion above a height that persists, its frequency and truncation error.

        A branch of a periodic motion is followed from the highest points; from the start it was tried before. What is
        higher than its top may be a burst: it is followed on, and the highest that is left confirmed, or lost.
        """
        highest = sorted(self.points, key=lambda each: -self.points[each][0])[:MOST_TOPS]
        places = [
            place for place in dict.fromkeys((*highest, self.start_hz)) if self._height(place) > FLOOR * height_m
        ]
        best: tuple[float, RingMotion | None, float] = math.nan, None, 0.0
        branches = (self.branch(place, self._motion(place), height_m) for place in places if place != self.start_hz)
        best = next((found for found in branches if found is not None and _height_of(found) > height_m), best)
        if best[1] is not None:
            height_m = (1.0 + SAME_TOP) * _height_of(best)
        higher = [self._followed_on(place) for place in places if self._height(place) > height_m]
        for height, place, motion in sorted(filter(None, higher), key=lambda each: -each[0]):
            if height <= max(height_m, _height_of(best)):
                continue
            found = self._confirmed(place, motion, height_m)
            if found is not None and found.amplitude_m > _height_of(best):
                best = (found.repeats_after > 1 and self.branch(place, found, height_m)) or (place, found, 0.0)
        return best

    def _followed_on(self, place: float) -> tuple[float, float, RingMotion] | None:
        """Height, frequency and motion after some time at a point; None where it is lost."""
        try:
            found = self.integration.followed_on(2.0 * math.pi * place, self._motion(place))
        except ArithmeticError:
            return None
        self.spent += LONGER * found.n_blades
        if found.amplitude_m < KEEPS * self._height(place):
            self.lost.append(place)
        return found.amplitude_m, place, found

    def _confirmed(self, place: float, motion: RingMotion, height_m: float) -> RingMotion | None:
        """A motion with all its steps; None where it does not persist."""
        try:
            found, seen_m = self.integration.confirmed(2.0 * math.pi * place, motion, height_m)
        except ArithmeticError:
            self.seen_m = max(self.seen_m, motion.amplitude_m)
            return None
        self.spent += round(CONFIRMATION * (found.periods - motion.periods) * found.n_blades)
        self.seen_m = max(self.seen_m, seen_m)
        if not counts(found):
            self.lost.append(place)
            return None
        self.points[place] = found.amplitude_m, found.final
        return found

    def _height(self, place: float) -> float:
        return self.points[place][0]

    def _motion(self, place: float) -> RingMotion:
        """The motion of a point."""
        height, state = self.points[place]
        return replace(self.start, amplitude_m=height, final=state)

    def branch(self, place: float, motion: RingMotion, height_m: float) -> tuple[float, RingMotion, float] | None:
        """The top of the branch of a periodic motion, its frequency and truncation error; None where it has none."""
        try:
            branch = ring_branch(self.integration, place, motion, height_m)
        except ArithmeticError:
            return None
        if branch is None:
            return None
        self.spent += branch.blade_periods
        self.points |= {at: (top, motion.final) for at, top in branch.places.items()}
        return branch.top_hz, branch.top(motion), branch.truncation_error


def _height_of(found: tuple[float, RingMotion | None, float]) -> float:
    return 0.0 if found[1] is None else found[1].amplitude_m
