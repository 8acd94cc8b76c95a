"""States of a ring that no branch leads to: some blades on a high and others on a low solution, and random ones.

A localised motion needs such a start; others persist beside all solutions.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np

from nonlinear.contact.parameters import Array
from nonlinear.response_curve import ResponseCurve
from nonlinear.time_integration.ring import RingState
from nonlinear.time_integration.ring_integrator import RingIntegrator
from nonlinear.time_integration.ring_motion import integrate_ring
from nonlinear.worst_motion.ring_integration import (
    FEWEST_PERIODS,
    MOST_BLADES,
    USUAL_PERIODS,
    Integrated,
    RingIntegration,
    Solution,
)
from nonlinear.worst_motion.solution_search import interpolated

SEED, LARGEST = 17, 1.5  # of random states; the largest multiple of the highest solution
RANDOM_STATES = {"quick": 0, "standard": 24, "thorough": 48}


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
        """Random states, in each ring in turn; they are the same in each run."""
        patterns, blades = self.patterns, self.integration.ring.blades
        chosen = [patterns[n % len(patterns)] for n in range(RANDOM_STATES[self.integration.options.search])]
        return [Start(pattern, (1.0,) * blades(pattern), number) for number, pattern in enumerate(chosen)]

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
            state = random_state(integrator, self.branches, np.random.default_rng((SEED, start.number)))
        else:
            found = [each for branch in self.branches for each in interpolated(branch, frequency_hz)]
            if len(found) < 2:
                return Integrated(None)
            heights = [float(np.abs(integrator.wave_output(each)).max()) for each in found]
            low, high = (integrator.on_wave(found[int(pick(heights))]) for pick in (np.argmin, np.argmax))
            limits = self.integration.limits(periods, max(height_m, *heights))
            state = low.towards(high, start.shares)
        return Integrated(integrate_ring(ring, omega, state, nodal_diameter=start.pattern, limits=limits))


def random_state(
    integrator: RingIntegrator, branches: Sequence[ResponseCurve], rng: np.random.Generator
) -> RingState:
    """The highest solution of a curve with a random phase and a random size, up to 1.5 times, on each blade."""
    branch = max(branches, key=lambda each: each.amplitude_m.max())
    high = integrator.on_wave(Solution.of(branch, int(branch.amplitude_m.argmax())).displacement)
    size, angle = rng.uniform(0.0, LARGEST, high.n_blades), rng.uniform(0.0, 2.0 * np.pi, high.n_blades)
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
