"""Where time integration of a curve starts, in order of what the motions may reach, as far as its budget goes."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import count, pairwise, product

import numpy as np

from nonlinear.response_curve import ResponseCurve
from nonlinear.time_integration.ring_motion import RingMotion
from nonlinear.worst_motion.candidates import (
    CLEARLY_HIGHER,
    COULD_MATTER,
    Place,
    UnstableStretch,
    coexistences,
    high_places,
    highest_beside,
    persists,
    stable_amplitudes,
)
from nonlinear.worst_motion.ring_integration import FLOOR, Integrated, counts
from nonlinear.worst_motion.ring_starts import RingStarts, Start
from nonlinear.worst_motion.stepped_sweep import Sweep

ONE_START = 0.3  # share of the periods times blades of a curve for one start: large rings are left out
# shares up to which unstable solutions, mixed starts, random states, then swept ones: the rest follows motions
TO_DEPART, TO_MIX, TO_START, TO_SWEEP = 0.4, 0.55, 0.75, 0.85
SPARED = 0.5  # share that unstable solutions do not get where a motion persists that is as high as all of them
MOST_FURTHER = 4  # starts after those from the highest points of the unstable stretches
MOST_EXPLORED = 8  # the same with those that would take too long
FASTER = 1.5  # ratio of two growths in a period from which the faster one is a start of its own
# periods for a motion that is clearly higher than all that persist, also where none are left, and how many have them
LEAST_SWEEP, MOST_LATE = 1500, 2
# motions whose branch is sought by harmonic balance of several blades, and their least height, of the highest known
MOST_BRANCHES, LEAST_BRANCH = 2, 0.4
TOLD = 3.0  # growth (of the logarithm) of a disturbance that has to be missing where a ring stays all the same
# shares of the way through a range with two solutions, from the end where the high one is lower, of mixed starts: the
# first one, the next where blades have left the high solution there, and where not
FIRST_MIXED, MIXED_BEFORE, MIXED_BEYOND = 0.25, 0.125, 0.5
FALLING = 0.05  # relative fall of a motion that is still falling
SAME_SWEEP = 0.2  # relative difference of the heights of two motions in time at one frequency that count as one
SAME_AMPLITUDE = 0.05  # relative difference from a stable solution up to which a periodic motion counts as it
SPENT = "was left out after so many others"  # of a start for which too few periods are left

Integrate = Callable[[Place, int, float], Integrated]
Follow = Callable[[float, RingMotion, int, float], Sweep]


@dataclass(frozen=True)
class Departure:
    """What the ring does from an unstable solution."""

    place: Place  # branch and index of the solution
    frequency_hz: float  # its frequency, Hz
    motion: RingMotion | None  # the motion that the ring reaches; None where there is none
    known: bool = False  # whether that is a stable solution of the branches
    # whether the ring fell below what was worth following, or was still falling at the end, and not higher then than
    # the highest motion known
    falls: bool = False
    failure: str = ""  # why there is no motion, or none of the pattern that grows fastest
    failed: bool = False  # whether time integration was tried and failed
    spent: bool = False  # whether too few periods were left to find a motion
    sweep: Sweep | None = None  # the motion over the frequency, where it was followed
    reach_m: float = 0.0  # how high the solution is where there is no motion, or those of the range, m
    start: str = ""  # of a ring that does not start from one solution: "mixed" or "random"
    open: bool = False  # whether the motion was to be followed, and there were no periods left

    @property
    def unbounded(self) -> bool:
        """Whether the motion grows without bound."""
        return self.motion is not None and self.motion.unbounded

    @property
    def reached_m(self) -> float:
        """Amplitude of a motion that is no stable solution of the branches, m; 0 otherwise.

        Where the ring stays on the solution, it is the height of that, without what is left of the disturbance.
        """
        if self.motion is None or self.known or self.falls or self.unbounded:
            return 0.0
        return self.motion.started_m if self.motion.stays else _height(self.motion)

    @property
    def seen_m(self) -> float:
        """Largest displacement that it was seen to reach where it did not settle or was followed on, m."""
        followed = self.sweep.seen_m if self.sweep is not None else 0.0
        return max(followed, 0.0 if self.motion is None or counts(self.motion) else self.reached_m)

    @property
    def new_height(self) -> float:
        """The same, 0 for a motion that has neither settled nor kept its height for long, or was not confirmed.

        It may be a transient, which says nothing of what persists.
        """
        return self.reached_m if self.motion is not None and counts(self.motion) and not self.open else 0.0


@dataclass
class DepartureSearch:
    """Time integration from the unstable stretches of a curve."""

    branches: Sequence[ResponseCurve]  # main branch and detached ones
    # integrates the ring from a solution (branch, index), disturbed in its worst pattern, for so many blades times
    # periods at most, where the highest motion known has an amplitude, m
    integrate: Integrate
    height_m: float  # amplitude of the highest stable solution, m
    # relative difference of amplitudes up to which a periodic motion counts as a stable solution
    tolerance: float = SAME_AMPLITUDE
    blade_periods: int = 0  # blades times periods that may be integrated
    follow: Follow | None = None  # follows a motion from a frequency with so many blades times periods at most
    mix: RingStarts | None = None  # mixed starts and random states
    _highest: float = field(default=0.0, init=False)  # of the motions found

    def __post_init__(self) -> None:
        """Shares of what may be integrated."""
        self._one_start, self._to_depart, self._to_mix, self._to_start, self._to_sweep = (
            round(share * self.blade_periods) for share in (ONE_START, TO_DEPART, TO_MIX, TO_START, TO_SWEEP)
        )
        self._spent = 0

    def departures(self, stretches: Sequence[UnstableStretch]) -> Iterator[Departure]:
        """From a few exposed points of each stretch, then from other points of one of them.

        The highest motion of a stretch need not be where the unstable solution is highest. The stretch is the one
        that led to the highest motion; the highest one, if that motion is lower than its unstable solutions.
        """
        best, chosen, centre = 0.0, 0, -1
        tried: list[list[int]] = []
        for number, stretch in enumerate(stretches):
            tried.append(self._first(stretch))
            seen = False  # whether a ring was integrated from this stretch: what others leave open is not said then
            for position in tried[-1]:
                found = self._departure(stretch, position)
                if found.motion is not None or not seen:
                    yield found
                seen = seen or found.motion is not None
                if found.new_height > best:
                    best, chosen, centre = found.new_height, number, position
        if stretches and max(best, self.height_m) >= stretches[0].height_m:
            self._to_depart -= round(SPARED * self._to_depart)
        if stretches and best >= stretches[0].height_m:
            yield from self._refined(stretches[chosen], tried[chosen], best, centre)
        elif stretches:
            yield from self._explored(stretches[0], tried[0])
        if best <= self.height_m:
            for stretch, before in zip(stretches, tried, strict=True):
                for position in self._beside_the_highest(stretch):
                    if position not in before and (found := self._departure(stretch, position)).motion is not None:
                        yield found

    def mixed(self) -> Iterator[Departure]:
        """From mixed starts in the ranges with two solutions, the highest first.

        Near one end of a range the blades keep the high solution, near the other they leave it.
        """
        ranges = coexistences(self.branches) if self.mix else []
        starts = self.mix.starts if self.mix else []
        shares, tried = dict.fromkeys(product(starts, range(len(ranges))), FIRST_MIXED), set[int]()
        for again in (False, True):
            for start, number in shares:
                if again and not start.again:
                    continue
                at, most_m = ranges[number].at(shares[start, number]), ranges[number].height_m
                found, lost = self._from_state(at, most_m, start, self._to_mix)
                shares[start, number] = MIXED_BEFORE if lost else MIXED_BEYOND
                if found is not None and not (found.spent and number in tried):
                    yield found
                tried.add(number)

    def random(self) -> Iterator[Departure]:
        """From random states, spread over the frequencies with high solutions, as long as there are periods left."""
        places = high_places(self.branches, COULD_MATTER * max(self.height_m, self._highest))
        for start, share in zip(self.mix.random_starts if self.mix else (), _spread(), strict=False):
            at = float(places[0] + share * (places[-1] - places[0]))
            found, _ = self._from_state(at, math.inf, start, self._to_start)
            if found is not None and found.spent:
                return
            if found is not None:
                yield found

    def swept(self) -> Iterator[Departure]:
        """From random states swept upwards from the resonance without contact, as long as there are periods left."""
        mix = self.mix
        if mix is None:
            return
        for start in mix.swept_starts:
            height = max(self.height_m, self._highest)
            try:
                at, (motion, failure) = mix.swept(start, self._to_sweep - self._spent, height)
            except ArithmeticError:
                continue
            place = highest_beside(self.branches, at)
            if motion is None or place is None:
                if failure:
                    return
                continue
            self._spent += motion.periods * motion.n_blades
            found = replace(self._judged(place, at, motion, ""), start=start.kind)
            self._highest = max(self._highest, found.new_height)
            yield found

    def _from_state(
        self, frequency_hz: float, most_m: float, start: Start, most: int
    ) -> tuple[Departure | None, bool]:
        """What the ring does from a mixed or random start, and whether it falls below the high solution.

        Nothing is integrated where the high solutions, up to `most_m`, are low. A motion that has not settled, and is
        not above all that are known, falls. `most`: blades times periods that may be spent then.
        """
        height = max(self.height_m, self._highest)
        if self.mix is None or most_m < COULD_MATTER * height:
            return None, True
        place = highest_beside(self.branches, frequency_hz)
        if place is None:
            return None, True
        high = float(self.branches[place[0]].amplitude_m[place[1]])
        none = Departure(place, frequency_hz, None, reach_m=min(most_m, high), start=start.kind)
        try:
            motion, failure = self.mix(frequency_hz, start, most - self._spent, height)
        except ArithmeticError as error:
            return replace(none, failure=f"failed: {error}", failed=True), True
        if motion is None:
            return replace(none, failure=failure, spent=True) if failure else None, True
        self._spent += motion.periods * motion.n_blades
        found = replace(self._judged(place, frequency_hz, motion, ""), start=start.kind)
        found = replace(found, falls=found.falls or (not counts(motion) and _height(motion) <= height))
        self._highest = max(self._highest, found.new_height)
        return found, motion.amplitude_m < FLOOR * high

    def followed(self, departures: Sequence[Departure]) -> list[Departure]:
        """The departures with the motions that no branch holds followed over the frequency, the highest first.

        Those that have settled, or kept their height for long, come before the others.
        Each is taken at its highest point where it persists; where it persists nowhere, it falls. One that lies on
        another that was followed is known. Low ones are left out.
        """
        follow = self.follow
        if follow is None:
            return list(departures)
        found, known, highest, late, tried = list(departures), list[Sweep](), self.height_m, 0, 0
        order = sorted(range(len(found)), key=lambda index: (-found[index].new_height, -found[index].reached_m))
        for number in order:
            each = found[number]
            if each.motion is None or each.motion.stays or not each.reached_m:
                continue
            if any(sweep.top is not None and _lies_on(sweep, each) for sweep in known):
                found[number] = replace(each, known=True)
                continue
            left, least = self.blade_periods - self._spent, LEAST_SWEEP * each.motion.n_blades
            if over := left < least and late < MOST_LATE and each.reached_m > (1.0 + CLEARLY_HIGHER) * highest:
                left = least
            is_low = each.reached_m < FLOOR * highest or left <= 0
            if is_low and (tried >= MOST_BRANCHES or each.reached_m < LEAST_BRANCH * highest):
                found[number] = replace(each, open=True)
                continue
            sweep = follow(each.frequency_hz, each.motion, 0 if is_low else left, highest)
            tried, late = tried + 1, late + (over and not sweep.solved)
            if is_low and sweep.top is None:
                found[number] = replace(each, open=True)
                continue
            known.append(sweep)
            self._spent += sweep.blade_periods
            found[number] = self._at_top(each, sweep)
            highest = max(highest, found[number].new_height)
        return found

    def _at_top(self, departure: Departure, sweep: Sweep) -> Departure:
        """A departure whose motion was followed, at the highest point where that persists."""
        if sweep.top is None or departure.motion is None:
            return replace(departure, falls=True, sweep=sweep)
        top = replace(sweep.top, started_m=departure.motion.started_m)
        found = self._judged(departure.place, sweep.top_hz, top, departure.failure)
        known = found.known and not sweep.solved  # one of several blades is none of the wave
        return replace(found, known=known, falls=False, sweep=sweep, start=departure.start)

    def _refined(
        self, stretch: UnstableStretch, tried: Sequence[int], best: float, centre: int
    ) -> Iterator[Departure]:
        """From points that halve the gaps in index beside the highest motion; low solutions are left alone."""
        for _ in range(MOST_FURTHER):
            position = self._halfway(stretch, tried, centre)
            if position is None:
                return
            tried = [*tried, position]
            found = self._departure(stretch, position)
            if found.motion is None:
                return  # the motion of the stretch is known
            yield found
            if found.new_height > best:
                best, centre = found.new_height, position

    def _explored(self, stretch: UnstableStretch, tried: Sequence[int]) -> Iterator[Departure]:
        """From points that halve the largest gaps in index; low solutions are left alone."""
        integrated = 0
        for _ in range(MOST_EXPLORED):
            position = self._halfway(stretch, tried, None)
            if position is None or integrated == MOST_FURTHER:
                return
            tried = [*tried, position]
            found = self._departure(stretch, position)
            if found.spent:
                return
            integrated += found.motion is not None
            yield found

    def _halfway(self, stretch: UnstableStretch, tried: Sequence[int], centre: int | None) -> int | None:
        """The position in the middle of the larger gap beside `centre`, or of the largest one; None where none is.

        Gaps are between the positions tried and the ends of the parts that are not low.
        """
        heights = self.branches[stretch.branch].amplitude_m[stretch.exposed]
        high = np.flatnonzero(heights >= FLOOR * self.height_m)
        if not high.size:
            return None
        return _next(sorted({int(high[0]) - 1, *tried, int(high[-1]) + 1}), centre)

    def _first(self, stretch: UnstableStretch) -> list[int]:
        """Positions of the first starts: the highest point, after that of the fastest growth if it is clearly faster.

        Low points are left alone.
        """
        heights = self.branches[stretch.branch].amplitude_m[stretch.exposed]
        top = int(np.argmax(heights))
        growth = np.nan_to_num([self._growth((stretch.branch, int(index))) for index in stretch.exposed])
        high = heights >= FLOOR * max(heights[top], self.height_m)
        fastest = int(np.argmax(np.where(high, growth, -np.inf)))
        return [fastest, top] if high.any() and growth[fastest] > FASTER * growth[top] else [top]

    def _beside_the_highest(self, stretch: UnstableStretch) -> list[int]:
        """Positions of the ends where the highest stable motion loses its stability: what begins there is higher."""
        branch, exposed = self.branches[stretch.branch], stretch.exposed
        beside = {0: int(exposed[0]) - 1, len(exposed) - 1: int(exposed[-1]) + 1}
        stable = np.where(persists(branch), branch.amplitude_m, 0.0)
        high = (1.0 - CLEARLY_HIGHER) * self.height_m
        return [n for n, index in beside.items() if 0 <= index < branch.points and stable[index] >= high > 0.0]

    def _departure(self, stretch: UnstableStretch, position: int) -> Departure:
        place = stretch.branch, int(stretch.exposed[position])
        frequency_hz = float(self.branches[place[0]].frequency_hz[place[1]])
        height = max(self.height_m, self._highest)
        try:
            left = max(self._to_depart - self._spent, 0)
            motion, failure = self.integrate(place, min(left, self._one_start), height)
        except ArithmeticError as error:
            return Departure(place, frequency_hz, None, failure=f"failed: {error}", failed=True)
        if motion is None:
            spent = left < self._one_start
            return Departure(place, frequency_hz, None, failure=SPENT if spent else failure, spent=spent)
        self._spent += motion.periods * motion.n_blades
        found = self._judged(place, frequency_hz, motion, failure)
        self._highest = max(self._highest, found.new_height)
        return found

    def _judged(self, place: Place, frequency_hz: float, motion: RingMotion, failure: str) -> Departure:
        """A motion at a frequency, and whether it is known, or falls."""
        height = max(self.height_m, self._highest)
        is_high = motion.started_m >= (1.0 - CLEARLY_HIGHER) * height
        if motion.stays and is_high and self._growth(place) * motion.periods < TOLD:
            motion = replace(motion, stays=False, settled=False, persistence=0)
        stable = stable_amplitudes(self.branches, frequency_hz)
        near = np.abs(stable - motion.amplitude_m) <= self.tolerance * stable
        steady = motion.lowest_m >= (1.0 - 2.0 * self.tolerance) * motion.amplitude_m  # on its way to it
        known = bool(np.any(near)) and (motion.periodic if motion.settled else steady)
        falls = _height(motion) < FLOOR * height or (_falls(motion) and _end(motion) <= height)
        falls = falls or self._is_held(motion)
        return Departure(place, frequency_hz, motion, known, falls, failure)

    def _is_held(self, motion: RingMotion) -> bool:
        """Whether sliders that hold a deflection make the height of a motion.

        It vibrates no more than a solution that persists, or less than it is deflected: residual tractions do that.
        """
        if self.mix is None or not self.mix.slides:
            return False
        vibration, static = self._vibration_and_static_m
        deflection = motion.amplitude_m - motion.vibration_m - static
        return motion.vibration_m <= max((1.0 + CLEARLY_HIGHER) * vibration, deflection)

    @cached_property
    def _vibration_and_static_m(self) -> tuple[float, float]:
        """Largest vibration of a solution that persists, and largest mean displacement of one, m."""
        stable = [(each.amplitude_m[persists(each)], abs(each.static_m[persists(each)])) for each in self.branches]
        vibration = max(float((height - mean).max(initial=0.0)) for height, mean in stable)
        return vibration, max(float(mean.max(initial=0.0)) for _, mean in stable)

    def _growth(self, place: Place) -> float:
        """Logarithm of the growth of perturbations of a solution in a period."""
        branch, index = self.branches[place[0]], place[1]
        return float(branch.growth_rate[index] / branch.frequency_hz[index])


def _spread() -> Iterator[float]:
    """Shares of a range that divide it ever more finely (van der Corput 1935)."""
    for number in count(1):
        yield sum(int(digit) / 2.0 ** (place + 1) for place, digit in enumerate(reversed(f"{number:b}")))


def _lies_on(sweep: Sweep, departure: Departure) -> bool:
    """Whether a motion is one of a sweep."""
    at, places = departure.frequency_hz, sweep.frequency_hz
    height = float(np.interp(at, places, sweep.amplitude_m))
    same = SAME_AMPLITUDE if sweep.solved else SAME_SWEEP
    return bool(places[0] <= at <= places[-1]) and abs(departure.reached_m - height) <= same * height


def _height(motion: RingMotion) -> float:
    """Height of a motion, m: one that has not settled may come again as high as in the last third of the time."""
    return motion.amplitude_m if motion.settled else max(motion.amplitude_m, _end(motion))


def _end(motion: RingMotion) -> float:
    """Largest displacement in the last third of the time, m."""
    return _thirds(motion)[2]


def _falls(motion: RingMotion) -> bool:
    """Whether a motion that has not settled was lower in the last third of the time than in the third before."""
    if motion.settled:
        return False
    _, before, last = _thirds(motion)
    return last < (1.0 - FALLING) * before


def _thirds(motion: RingMotion) -> list[float]:
    """Largest displacements in each third of the time, m."""
    return [float(third.max()) for third in np.array_split(motion.envelope_m.max(axis=1), 3)]


def _next(tried: Sequence[int], centre: int | None) -> int | None:
    """A position in the larger gap beside `centre`, or in the largest of all; None where there is none.

    `tried` is sorted and holds the positions before the first and after the last one.
    """
    if centre is not None:
        place = list(tried).index(centre)
        tried = tried[place - 1 : place + 2]
    gaps = [(after - before, (before + after) // 2) for before, after in pairwise(tried) if after - before > 1]
    return max(gaps)[1] if gaps else None
