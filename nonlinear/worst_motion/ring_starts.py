"""States of a ring that no branch leads to: some blades on a high and others on a low solution, and random ones.

A localised motion needs such a start; others persist beside all solutions. Random states are spread over the
frequencies, or begin near the resonance without contact, where nearly all of them end on few motions, and are swept
upwards from there: contacts that open and close stiffen, and what is high lives on to higher frequencies.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np

from nonlinear.contact.parameters import Array
from nonlinear.response_curve import ResponseCurve
from nonlinear.time_integration.ring import Ring, RingState
from nonlinear.time_integration.ring_integrator import RingIntegrator
from nonlinear.time_integration.ring_motion import RingMotion, integrate_ring
from nonlinear.worst_motion.ring_integration import (
    FEWEST_BLADES,
    FEWEST_PERIODS,
    MOST_BLADES,
    USUAL_PERIODS,
    Integrated,
    RingIntegration,
    Solution,
    counts,
)
from nonlinear.worst_motion.solution_search import interpolated
from rom.cyclic.contact_springs import contact_springs

LEFT_OUT = "from {} states was left out"
RANDOM_STATES = {"quick": 0, "standard": 24, "thorough": 48}
SWEPT_STATES = {"quick": (0, 0), "standard": (1, 8), "thorough": (12, 24)}  # where small rings exist, and where not
SEED, SIZE = 17, 1.5  # of random states: what `seed` of the options adds to; largest multiple of the highest solution
# of those that are swept: largest multiples of the highest motion known, and shares of the way from the resonance
# without contact to that of stuck contacts where they begin, in turn
LARGEST, BEGINS = (3.0, 1.5, 5.0), (0.05, 0.0, 0.1, 0.025, 0.075, 0.125)
AROUND = 0.03  # of the two resonances, that belongs to the range between them
# periods before a sweep, of a step and of its window; step relative to the frequency
SETTLES, STEP, STEP_WINDOW, SWEEP_STEP = 100, 40, 24, 4e-3
LOST, LOW = 0.5, 0.15  # of the height of the step before, and of the highest motion known, below which a sweep ends
MOST_HELD = 6  # highest steps of a sweep that are held until the motion persists at one


class Start(NamedTuple):
    """A state of a ring, blade by blade."""

    pattern: int  # nodal diameter that the ring carries
    shares: tuple[float, ...]  # of each blade, on the way from the low to the high solution
    number: int = -1  # of a random state; -1: none
    again: bool = False  # whether a range of frequencies has a second such start

    @property
    def kind(self) -> str:
        """Which start it is."""
        return "mixed" if self.number < 0 else "random"


@dataclass(frozen=True)
class RingStarts:
    """Rings of up to 8 blades that start from such states."""

    integration: RingIntegration
    branches: Sequence[ResponseCurve]

    @property
    def in_flow(self) -> bool:
        """Whether a flow acts on the blades, that feeds motions."""
        return bool(self.integration.ring.modal.influence)

    @property
    def slides(self) -> bool:
        """Whether contacts slide."""
        return bool(self.integration.ring.contact.friction.any())

    @cached_property
    def patterns(self) -> list[int]:
        """Nodal diameters of rings of up to 8 blades that no larger one of them contains, that of most blades first.

        That of the wave where it needs more blades.
        """
        ring = self.integration.ring
        few: dict[int, int] = {}
        for k in range((ring.modal.n_blades or 0) // 2 + 1):
            few.setdefault(ring.blades(k), k)
        sizes = [size for size in sorted(few, reverse=True) if size <= MOST_BLADES]
        whole = [size for size in sizes if not any(other > size and other % size == 0 for other in sizes)]
        return [few[size] for size in whole] or [0]

    @property
    def starts(self) -> list[Start]:
        """All but one, half, or one of neighbours on the high solution, once or several times around the ring.

        A thorough search: each arrangement.
        """
        found: dict[tuple[int, ...], Start] = {}
        thorough = self.integration.options.search == "thorough"
        for pattern in self.patterns if thorough else self.patterns[:1]:
            blades = self.integration.ring.blades(pattern)
            few = [
                size
                for size in range(blades, 1, -1)
                if blades % size == 0 and (size <= MOST_BLADES or size == blades)
            ]
            kinds = [(size, number) for size in few for number in dict.fromkeys((size - 1, size // 2, 1))]
            kinds = sorted(kinds, key=lambda kind: -kind[1] / kind[0])
            usual = [tuple(int(blade % size < number) for blade in range(blades)) for size, number in kinds]
            others = _arrangements(blades) if thorough and blades <= MOST_BLADES else []
            for shares in (*usual, *others):
                found.setdefault(_least_turned(shares), Start(pattern, shares, again=shares in usual))
        return list(found.values())

    @property
    def random_starts(self) -> list[Start]:
        """Random states, in each ring in turn; the same in each run with a seed. None where rings are too small."""
        patterns, blades = self.patterns, self.integration.ring.blades
        count = 0 if self._other_ring() else RANDOM_STATES[self.integration.options.search]
        chosen = [patterns[n % len(patterns)] for n in range(count)]
        return [Start(pattern, (1.0,) * blades(pattern), number) for number, pattern in enumerate(chosen)]

    @property
    def swept_starts(self) -> list[Start]:
        """Random states that are swept upwards; more of them where no small ring is a part of the whole one."""
        few, many = SWEPT_STATES[self.integration.options.search]
        pattern, blades = self.patterns[0], self.integration.ring.blades(self.patterns[0])
        if other := self._other_ring():
            few, pattern, blades = many, self._whole_pattern, other
        return [Start(pattern, (1.0,) * blades, number) for number in range(few)]

    def _other_ring(self) -> int:
        """Blades of a ring of up to 8 with the phase angle of the wave that is no part of the whole one; 0: none."""
        ring = self.integration.ring
        if ring.blades_apart is not None or ring.modal.waves_differ or not ring.modal.neighbours_coupled:
            return 0
        if max(map(ring.blades, self.patterns)) >= FEWEST_BLADES:
            return 0
        return ring.wave_blades * (MOST_BLADES // ring.wave_blades)

    @property
    def _whole_pattern(self) -> int:
        """A nodal diameter that needs all blades."""
        ring = self.integration.ring
        return max(range((ring.modal.n_blades or 1) // 2 + 1), key=ring.blades)

    def __call__(self, frequency_hz: float, start: Start, blade_periods: int, height_m: float) -> Integrated:
        """The motion that the ring reaches; none where there are not two solutions, or too few blades times periods.

        Blades that fall clearly below the high solution have left it.
        """
        ring, omega = self.integration.ring, 2.0 * np.pi * frequency_hz
        periods = min(USUAL_PERIODS, blade_periods // len(start.shares))
        if periods < FEWEST_PERIODS:
            return Integrated(None, f"from {start.kind} states was left out")
        limits, integrator = self.integration.limits(periods, height_m), self.integration.coarse(omega, start.pattern)
        if start.number >= 0:
            state = self._random_state(integrator, SIZE * self._highest_solution_m, self._rng(start))
        else:
            found = [each for branch in self.branches for each in interpolated(branch, frequency_hz)]
            if len(found) < 2:
                return Integrated(None)
            heights = [float(np.abs(integrator.wave_output(each)).max()) for each in found]
            low, high = (integrator.on_wave(found[int(pick(heights))]) for pick in (np.argmin, np.argmax))
            limits = self.integration.limits(periods, max(height_m, *heights))
            state = low.towards(high, start.shares)
        motion = integrate_ring(ring, omega, state, nodal_diameter=start.pattern, limits=limits)
        return Integrated(self.integration.kept(omega, motion, height_m))

    def swept(self, start: Start, blade_periods: int, height_m: float) -> tuple[float, Integrated]:
        """The highest motion that a random state reaches on a sweep upwards, and its frequency, Hz.

        In a ring with nearly the phase angle of the wave where no small ring carries it: then the whole ring is
        integrated from what it has reached.
        """
        free_hz, stuck_hz = self.resonances_hz
        frequency_hz = free_hz + BEGINS[start.number % len(BEGINS)] * (stuck_hz - free_hz)
        ring, blades = self._swept_ring(start), len(start.shares)
        if blade_periods < (SETTLES + FEWEST_PERIODS) * blades:
            return frequency_hz, Integrated(None, LEFT_OUT.format(start.kind))
        integration = replace(self.integration, ring=ring)
        pattern = start.pattern if ring is self.integration.ring else 1
        integrator = integration.coarse(2.0 * np.pi * frequency_hz, pattern)
        largest = LARGEST[start.number % len(LARGEST)] * max(height_m, self._highest_solution_m)
        rng = self._rng(start)
        record = integrator.march(self._random_state(integrator, largest, rng, start.number % 2 == 0), SETTLES)
        track = [(float(record.envelope_m[-STEP_WINDOW:].max()), frequency_hz, record.final)]
        left = blade_periods - (SETTLES + FEWEST_PERIODS) * blades
        while (left := left - STEP * blades) >= 0 and (at := track[-1][1] * (1.0 + SWEEP_STEP)) <= stuck_hz:
            record = integration.coarse(2.0 * np.pi * at, pattern).march(track[-1][2], STEP)
            height = float(record.envelope_m[-STEP_WINDOW:].max())
            if height < max(LOST * track[-1][0], LOW * height_m):
                break
            track.append((height, at, record.final))
        periods = (SETTLES + STEP * len(track)) * blades // ring.blades(pattern)
        at, motion = self._held(start, sorted(track, key=lambda step: -step[0]), height_m)
        return at, Integrated(replace(motion, periods=motion.periods + periods))

    def _held(
        self, start: Start, steps: Sequence[tuple[float, float, RingState]], height_m: float
    ) -> tuple[float, RingMotion]:
        """The motion at the highest step of a sweep where it persists, else the highest; and its frequency, Hz."""
        ring, held = self.integration.ring, list[tuple[float, RingMotion]]()
        limits = self.integration.limits(USUAL_PERIODS, height_m)
        for _, at, state in steps:
            if len(held) == MOST_HELD:
                break
            if any(abs(at / other - 1.0) < 1.5 * SWEEP_STEP for other, _ in held):
                continue
            whole = state.over(ring.blades(start.pattern))
            motion = integrate_ring(ring, 2.0 * np.pi * at, whole, nodal_diameter=start.pattern, limits=limits)
            if counts(motion):
                return at, motion
            held.append((at, motion))
        return max(held, key=lambda each: each[1].amplitude_m)

    @property
    def _highest_solution_m(self) -> float:
        return max(float(branch.amplitude_m.max(initial=0.0)) for branch in self.branches)

    @cached_property
    def resonances_hz(self) -> tuple[float, float]:
        """The first resonance in the range without contact and with stuck contacts, Hz, with what is around them."""
        ring, (low, high) = self.integration.ring, self.integration.options.frequency_hz
        modal, contact = ring.modal.at(0), ring.contact
        frequency = modal.angular_frequency / (2.0 * np.pi)
        mode = min(int(np.searchsorted(frequency, low * (1.0 - AROUND))), frequency.size - 1)
        stiffness = contact.normal_stiffness[: modal.n_contacts], contact.tangential_stiffness[: modal.n_contacts]
        springs = contact_springs(modal.n_contacts, *stiffness)
        stuck = 0.0
        for turn in (1.0, -1.0):
            motion = modal.right if modal.left is None else modal.right - turn * modal.left
            matrix = np.diag(modal.angular_frequency**2) + motion.T @ (springs.reshape(-1, 1) * motion)
            stuck = max(stuck, float(np.sqrt(np.linalg.eigvalsh(matrix)[mode])) / (2.0 * np.pi))
        free_hz = float(np.clip(frequency[mode] * (1.0 - AROUND), low, high))
        return free_hz, float(np.clip(stuck * (1.0 + AROUND), free_hz, high))

    def _swept_ring(self, start: Start) -> Ring:
        """The ring of a random start: another one where its number of blades is not that of the pattern."""
        ring, count = self.integration.ring, len(start.shares)
        if count == ring.blades(start.pattern):
            return ring
        order = round(ring.excitation.engine_order * count / (ring.modal.n_blades or 1)) % count
        excitation = replace(ring.excitation, engine_order=order)
        return replace(ring, modal=replace(ring.modal.at(0), n_blades=count), excitation=excitation)

    def _rng(self, start: Start) -> np.random.Generator:
        return np.random.default_rng((SEED + self.integration.options.seed, start.number))

    def _random_state(
        self, integrator: RingIntegrator, largest_m: float, rng: np.random.Generator, alone: bool = False
    ) -> RingState:
        """The highest solution of a curve with a random phase and size on each blade, `largest_m` at most."""
        branch = max(self.branches, key=lambda each: each.amplitude_m.max())
        solution = Solution.of(branch, int(branch.amplitude_m.argmax())).displacement
        return random_state(integrator, solution, largest_m / float(branch.amplitude_m.max()), rng, alone)


def random_state(
    integrator: RingIntegrator, displacement: Array, largest: float, rng: np.random.Generator, alone: bool = False
) -> RingState:
    """A solution with a random phase and a random size, up to a multiple, on each blade."""
    high = integrator.on_wave(displacement)
    size, angle = rng.uniform(0.0, largest, high.n_blades), rng.uniform(0.0, 2.0 * np.pi, high.n_blades)
    if alone:
        size[1:] *= 0.1
        size[0] = largest
    turn = np.reshape(size * np.exp(1j * angle), (-1, *[1] * (high.coordinates.ndim - 1)))
    turned: Array = turn * (high.coordinates - 1j * high.rates / integrator.omega)
    rest = integrator.at_rest()
    return RingState(turned.real, -integrator.omega * turned.imag, rest.slider, rest.force)


def _arrangements(blades: int) -> list[tuple[int, ...]]:
    """High (1) and low (0) blades in each arrangement that no turn of the ring takes to another, most high first."""
    every = {_least_turned(shares) for shares in product((0, 1), repeat=blades)}
    mixed = [shares for shares in every if 0 < sum(shares) < blades]
    return sorted(mixed, key=lambda shares: (-sum(shares), shares))


def _least_turned(shares: tuple[int, ...]) -> tuple[int, ...]:
    """The least of all turns of an arrangement."""
    return min(shares[turn:] + shares[:turn] for turn in range(len(shares)))
