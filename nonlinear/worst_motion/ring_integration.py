"""Time integration of the ring from an unstable solution of a curve, with few blades where few suffice.

The ring starts in the pattern of the worst perturbation, or of the worst that few blades carry.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.fourier import to_real
from nonlinear.contact.parameters import Array
from nonlinear.options import SEARCH_COST, SolverOptions
from nonlinear.response_curve import ResponseCurve
from nonlinear.stability.floquet import FloquetAnalysis
from nonlinear.stability.ring_stability import (
    LinearisedContact,
    PatternExponent,
    RingStability,
    largest_nodal_diameter,
)
from nonlinear.time_integration.ring import RETENTION, Ring
from nonlinear.time_integration.ring_integrator import RingIntegrator, with_more_harmonics
from nonlinear.time_integration.ring_motion import (
    KEEPS,
    RingLimits,
    RingMotion,
    integrate_ring,
    repeats_after,
    same_statistics,
)

NEARLY = 0.9  # share of a growth rate that counts as nearly as fast
MOST_BLADES = 8  # of a ring that is preferred to a larger one
FEWEST_BLADES = 4  # of a ring with localised motions
LARGE_RING = 24  # blades of the largest ring of a standard search, unless the wave needs more
ENOUGH = 0.5  # share of the largest growth rate that the pattern of a smaller ring needs to have
FEWEST_PERIODS = 200  # in which a ring leaves and settles, if it does so fast
USUAL_PERIODS = 300  # in which it usually does
MOST_PERIODS = 1000
WINDOW, SETTLING = 40, 48  # periods, see RingLimits
PERSISTENT = 240  # periods over which a motion that has not settled keeps its height to count as irregular
LONGER = 240  # periods for which a motion is followed on that would be the highest
# periods times blades, and periods at least, for which it is observed where it does not settle: bursts come rarely
OBSERVED, LEAST_OBSERVED = 8000, 1000
SLOWEST = 0.9  # of a disturbance, left after 20 periods, in the slowest decay that is looked for
RECURS = 0.05  # relative distance from the height of a motion within which it comes again
# work of a usual period of a blade, a step being one; changes of the forces of a node, times the nodes of a blade,
# that take as long as a step without them; periods from which the work of a period is known; power of the work that
# counts: where periods take long the search may take longer
USUAL_PERIOD, AS_A_STEP, PROBED, DEARER = 160.0, 65.0, 3, 0.9
FOLLOWED = 0.02  # disturbance then, relative to the vibration
# factors then on the highest frequency of modes that are integrated, as stiff contacts need them, and on the steps
CONFIRMED, CONFIRMED_STEPS = 2.0, 0.5
# relative change of a height by half the step that is none, and how often the step is halved for it
SAME_HEIGHT, MOST_HALVED = 1e-3, 6
# the same, and the share of the steps, of all that is looked at before: heights are the same within 1 %
COARSE, COARSE_STEPS = 0.5, 64 / 240
CONFIRMATION = 2.0  # cost of a period of a blade then, relative to one that is looked at
# periods times blades of time integration that cost as much as a point of a branch, for each Fourier coefficient
# (2 H + 1) that is balanced there: see docs/developers/method/worst_motion.md
EQUAL_COST = 20
FLOOR = 0.7  # of the highest motion known, below which a ring is not followed
VISIBLE = 0.02  # disturbance relative to the vibration, where no growth rate is to be measured
HARDLY_LEFT, LARGE = 0.1, 0.1  # relative difference of heights; disturbance of a ring that leaves slowly
MARGIN, MORE_HARMONICS = 2.0, 7  # of an error: factor on a change; fewest harmonics a rate is made by for it


@dataclass(frozen=True)
class RingPatterns:
    """Floquet exponents of a periodic solution by nodal diameter."""

    ring: Ring
    options: SolverOptions  # contact integration
    omega: float  # excitation frequency, rad/s
    displacement: Array  # (2H+1, n_c, 3), real Fourier coefficients of d, m

    def growth_rate(self, nodal_diameter: int) -> float:
        """Largest growth rate of perturbations of one nodal diameter, 1/s."""
        if largest_nodal_diameter(self.ring.modal) and nodal_diameter % (self.ring.modal.n_blades or 1):
            leading = self._stability.leading_of(self._contact, nodal_diameter)
            return -np.inf if leading is None else float(leading.exponent.real)
        found = self._analysis.exponents(*self._contact)
        if not found.size:
            return -np.inf
        exact = self._analysis.followed(*self._contact, complex(found[0]))  # one that decays is approximate
        return float(found[0].real if exact is None else exact.real)

    def rate_error(self, nodal_diameter: int) -> float:
        """Twice the change of a rate by twice as many harmonics, 1/s; NaN where no motion with these is found."""
        harmonics = max(2 * (len(self.displacement) // 2), MORE_HARMONICS)
        more = with_more_harmonics(self.ring, self.omega, self.displacement, harmonics)
        if len(more) == len(self.displacement):
            return float("nan")
        change = replace(self, displacement=more).growth_rate(nodal_diameter) - self.growth_rate(nodal_diameter)
        return MARGIN * abs(change)

    def worst(self) -> PatternExponent:
        """The least stable exponent of all nodal diameters, that of the wave included."""
        found = [PatternExponent(complex(self.growth_rate(0)), 0)]
        if largest_nodal_diameter(self.ring.modal):
            leading = self._stability.leading(self._contact)
            found += [] if leading is None else [leading]
        return max(found, key=lambda pattern: pattern.exponent.real)

    def worst_of_few_blades(self, most_blades: int) -> PatternExponent:
        """The least stable exponent of the nodal diameters that rings of so many blades carry, the wave included.

        Of patterns that grow nearly as fast, the one with the fewest blades.
        """
        found = [PatternExponent(complex(self.growth_rate(0)), 0)]
        if largest_nodal_diameter(self.ring.modal):
            approximate = self._stability.approximate(self._contact)
            small = [item for item in approximate if self.ring.blades(item[1]) <= most_blades]
            near = [item for item in small if item[0].real >= NEARLY * small[0][0].real]
            near = sorted(near, key=lambda item: self.ring.blades(item[1]))
            for sigma, k in near[:1]:
                refined = self._stability.followed(self._contact, PatternExponent(self.omega * sigma, k))
                found += [] if refined is None else [refined]
        return max(found, key=lambda pattern: pattern.exponent.real)

    @cached_property
    def _contact(self) -> LinearisedContact:
        element = contact_element(self.ring.contact, len(self.displacement) // 2, self.options)
        return LinearisedContact(self.displacement, element.evaluate(self.displacement).jacobian, self.omega)

    @cached_property
    def _stability(self) -> RingStability:
        return RingStability(self._analysis, self.ring.modal.n_blades or 1)

    @cached_property
    def _analysis(self) -> FloquetAnalysis:
        return FloquetAnalysis.of(self.ring.receptance(len(self.displacement) // 2), self.ring.contact)


@dataclass(frozen=True)
class Solution:
    """A periodic solution of the balance at one frequency."""

    omega: float  # excitation frequency, rad/s
    displacement: Array  # (2H+1, n_c, 3), real Fourier coefficients of d, m
    growth_rate: float  # largest growth rate of a perturbation, 1/s
    nodal_diameter: int  # k of that perturbation; below 0: not known

    @classmethod
    def of(cls, branch: ResponseCurve, index: int) -> "Solution":
        """A point of a branch, with the harmonics balanced there."""
        kept = int(branch.kept_harmonics[index]) + 1
        return cls(
            2.0 * np.pi * float(branch.frequency_hz[index]),
            to_real(branch.relative_displacement[index, :kept]),
            float(branch.growth_rate[index]),
            int(branch.growth_nodal_diameter[index]),
        )


class Integrated(NamedTuple):
    """What time integration from a solution gave."""

    motion: RingMotion | None  # the motion that the ring reaches; None where there is none
    # what was not integrated and why, such as "of 24 blades would take too long"; "" where nothing is left open
    failure: str = ""


@dataclass(frozen=True)
class RingIntegration:
    """Time integration from solutions of one curve."""

    ring: Ring
    options: SolverOptions  # options of the curve
    cost: float = 1.0  # of a period of a blade, relative to a usual one

    def __call__(self, solution: Solution, blade_periods: int, height_m: float) -> Integrated:
        """The motion that the ring reaches from a solution disturbed in a pattern that grows, with coarse steps.

        A pattern that needs too many blades is replaced by one that grows slower, and this is said. A ring that
        hardly leaves is disturbed by more, and integrated again with all its steps.
        """
        pattern, failure = self.pattern(solution), ""
        blades, most = self.ring.blades(pattern), self.most_blades
        if blades > most or (blades > MOST_BLADES and blade_periods < USUAL_PERIODS * blades):
            patterns = self._patterns(solution)
            found = patterns.worst_of_few_blades(MOST_BLADES)
            if blades > most and not found.grows(solution.omega):
                found = patterns.worst_of_few_blades(most)
            if found.grows(solution.omega):
                pattern, failure = found.nodal_diameter, f"of {blades} blades would take too long"
        chosen = self.ring.blades(pattern)
        if chosen > most or blade_periods < FEWEST_PERIODS * chosen:
            return Integrated(None, f"of {blades} blades would take too long")
        limits = self.limits(min(MOST_PERIODS, blade_periods // chosen), height_m)
        motion = self._motion(solution, pattern, limits)
        near = abs(motion.amplitude_m - motion.started_m) <= HARDLY_LEFT * motion.started_m
        if motion.stays or (motion.periodic and near):  # coarse steps may hold what leaves slowly
            periods = min(limits.most_periods, USUAL_PERIODS)
            fine = replace(limits, most_periods=periods, disturbance=LARGE, retention=RETENTION, finer=1.0)
            motion = self._motion(solution, pattern, fine)
        return Integrated(self.kept(solution.omega, motion, height_m), failure)

    @property
    def most_blades(self) -> int:
        """Largest number of blades that is integrated: all in a thorough search, and where blades differ."""
        if self.options.search == "thorough" or self.ring.blades_apart is not None:
            return max(self.ring.modal.n_blades or 1, self.ring.wave_blades)
        return max(LARGE_RING, self.ring.wave_blades)

    @staticmethod
    def limits(most_periods: int, height_m: float) -> RingLimits:
        """How a ring is looked at: coarsely, and not for long where it is far below the highest motion known."""
        return RingLimits(
            most_periods=most_periods,
            disturbance=VISIBLE,
            floor_m=FLOOR * height_m,
            window=WINDOW,
            settling=SETTLING,
            retention=COARSE * RETENTION,
            finer=COARSE_STEPS,
        )

    def coarse(self, omega: float, nodal_diameter: int) -> RingIntegrator:
        """The ring that carries a perturbation, with the steps and modes of `limits`."""
        limits = self.limits(0, 0.0)
        return RingIntegrator.of(
            self.ring, omega, nodal_diameter=nodal_diameter, retention=limits.retention, finer=limits.finer
        )

    def confirmed(self, omega: float, motion: RingMotion, height_m: float) -> tuple[RingMotion, float]:
        """A motion disturbed and followed on, or what the ring goes over to; and the largest displacement seen, m.

        In a ring of a multiple of its blades, if that is no large one, with more modes, and with half the step until
        its height does not change; once where it has not settled. One that does not settle is observed for long.
        Seen is what has kept its height for 240 periods with more modes, if only then.
        """
        steps = CONFIRMED_STEPS
        found = self.followed_on(omega, motion, CONFIRMED, steps)
        kept_m = found.amplitude_m * counts(found)
        for halved in range(MOST_HALVED):
            settled = found.settled or found.periodic
            if not (settled or (halved == 0 and counts(found))) or found.amplitude_m <= height_m:
                break
            steps *= 2.0
            finer = self.followed_on(omega, found, CONFIRMED, steps)
            kept_m = max(kept_m, finer.amplitude_m * counts(finer))
            change = abs(finer.amplitude_m - found.amplitude_m)
            found = replace(finer, height_error=finer.height_error + MARGIN * change / finer.amplitude_m)
            windows = finer.envelope_m.reshape(-1, WINDOW * finer.n_blades).max(axis=1)
            scatter = 0.0 if finer.periodic else float(np.ptp(windows))
            if change <= max(SAME_HEIGHT * finer.amplitude_m, scatter):
                break
        settled = found.settled and (found.periodic or motion.settled)  # one that is irregular may seem so by chance
        if settled or found.amplitude_m <= height_m:
            return found, kept_m
        observed, seen_m = self._observed(omega, found, max(steps / 2.0, CONFIRMED_STEPS))
        return observed, max(kept_m, seen_m)

    def _observed(self, omega: float, motion: RingMotion, finer: float) -> tuple[RingMotion, float]:
        """What persists of a motion observed for long, and the largest displacement seen since it was followed on, m.

        No longer than until it repeats: its height is the same in two parts.
        """
        pattern, state = self.pattern_of(motion), motion.final
        integrator = RingIntegrator.of(
            self.ring, omega, nodal_diameter=pattern, retention=CONFIRMED * RETENTION, finer=finer
        )
        effort = min(self.options.effort * SEARCH_COST[self.options.search], 1.0)
        effort /= self.cost
        most, envelope = effort * max(OBSERVED // motion.n_blades, LEAST_OBSERVED), motion.envelope_m
        repeats, settled = motion.repeats_after, False
        while len(envelope) + LONGER <= most and not (repeats and settled):
            record = integrator.march(state, LONGER)
            envelope, state = np.concatenate([envelope, record.envelope_m]), record.final
            repeats = repeats_after(record.ends[-WINDOW:], integrator.vibration(state))
            settled = len(envelope) >= 2 * LONGER and same_statistics(*envelope[-2 * LONGER :].reshape(2, LONGER, -1))
        if len(envelope) == len(motion.envelope_m):  # too little effort
            return motion, motion.amplitude_m
        kept = envelope[-LONGER:] if repeats and settled else what_persists(envelope)
        observed = replace(
            motion,
            settled=settled and same_statistics(*np.array_split(kept, 2)),
            persistence=len(kept),
            periodic=repeats > 0,
            repeats_after=repeats,
            amplitude_m=float(kept.max()),
            lowest_m=float(kept.min()),
            periods=motion.periods + len(envelope) - len(motion.envelope_m),
            envelope_m=kept,
            final=state,
        )
        return observed, float(envelope.max())

    def followed_on(
        self, omega: float, motion: RingMotion, retention: float = COARSE, finer: float = COARSE_STEPS
    ) -> RingMotion:
        """A motion disturbed and followed on, in a ring of a multiple of its blades; whether it has settled.

        With factors on the highest frequency of modes that are integrated and on the number of steps.
        """
        pattern, state = self.larger_pattern(motion), motion.final
        integrator = RingIntegrator.of(
            self.ring, omega, nodal_diameter=pattern, retention=retention * RETENTION, finer=finer
        )
        if integrator.n_blades > motion.n_blades:
            state = state.repeated(integrator.n_blades)
        share = min(motion.vibration_m / motion.amplitude_m, 1.0)  # of the displacement, without what sliders hold
        disturbed = integrator.disturbed(state, pattern, FOLLOWED * share * integrator.vibration(state))
        record = integrator.march(disturbed, LONGER)
        calm = record.envelope_m[WINDOW:]  # without what decays at first
        before, after = np.array_split(calm, 2)
        repeats = repeats_after(record.ends[-WINDOW:], integrator.vibration(record.final))
        height, change = at_the_end(calm, repeats) if repeats else (float(calm.max()), 0.0)
        return replace(
            motion,
            stays=False,
            settled=same_statistics(before, after),
            persistence=LONGER if after.max() >= KEEPS * calm.max() else 0,
            periodic=repeats > 0,
            repeats_after=repeats,
            amplitude_m=height,
            height_error=change / height,
            lowest_m=float(after.min()),
            n_blades=integrator.n_blades,
            periods=motion.periods + LONGER,
            envelope_m=calm,
            vibration_m=replace(record, output_m=record.output_m[-WINDOW:]).vibration_m,
            final=record.final,
        )

    def kept(self, omega: float, motion: RingMotion, height_m: float) -> RingMotion:
        """What becomes of a motion that would be the highest: two windows that agree are often a transient."""
        new = counts(motion) and motion.persistence < LONGER and motion.amplitude_m > height_m
        return self.followed_on(omega, motion) if new and not (motion.stays or motion.unbounded) else motion

    def pattern_of(self, motion: RingMotion) -> int:
        """Nodal diameter that a ring of as many blades as a motion carries."""
        return self._by_blades(motion)[motion.n_blades]

    def larger_pattern(self, motion: RingMotion) -> int:
        """Nodal diameter that the largest ring carries of a multiple of the blades of a motion that are not many."""
        blades = self._by_blades(motion)
        return blades[max(blades)]

    def _by_blades(self, motion: RingMotion) -> dict[int, int]:
        """Nodal diameters by the number of blades of their rings, multiples of those of a motion."""
        own = motion.nodal_diameter
        blades = {motion.n_blades: own} if self.ring.blades(own) == motion.n_blades else {}
        for k in range((self.ring.modal.n_blades or 0) // 2 + 1):
            number = self.ring.blades(k)
            if number == motion.n_blades or (number <= MOST_BLADES and number % motion.n_blades == 0):
                blades.setdefault(number, k)
        return blades

    def for_branches(self, branches: Sequence[ResponseCurve]) -> "RingIntegration":
        """The same with the cost near the highest solution of the main branch; as it is where the ring leaves none.

        Then nothing is integrated but by a thorough search, or where no small ring is a part of the whole one.
        """
        main, calm = branches[0], len(branches) == 1 and bool(branches[0].stable.all())
        sizes = (self.ring.blades(k) for k in range((self.ring.modal.n_blades or 0) // 2 + 1))
        small = any(FEWEST_BLADES <= size <= MOST_BLADES for size in sizes)
        if calm and small and self.options.search != "thorough":
            return self
        return self.with_cost(Solution.of(main, int(np.argmax(main.amplitude_m))))

    def with_cost(self, solution: Solution) -> "RingIntegration":
        """The same, with the cost of a period as the steps and iterations near a solution tell, 1 at least."""
        try:
            integrator = self.coarse(solution.omega, 0)
            moves = integrator.march(integrator.on_wave(solution.displacement), PROBED).moves
        except ArithmeticError:
            return self  # nothing will be integrated
        per_blade = moves / (PROBED * integrator.n_blades)
        work = integrator.steps + per_blade * self.ring.modal.n_contacts / AS_A_STEP
        return replace(self, cost=max(work / USUAL_PERIOD, 1.0) ** DEARER)

    def motion(self, solution: Solution, most_periods: int) -> RingMotion:
        """The same within some periods, however many blades, and with the growth rate of a small disturbance."""
        return self._motion(solution, self.pattern(solution), RingLimits(most_periods=most_periods))

    def _motion(self, solution: Solution, pattern: int, limits: RingLimits) -> RingMotion:
        start = solution.displacement
        return integrate_ring(self.ring, solution.omega, start, nodal_diameter=pattern, limits=limits)

    def pattern(self, solution: Solution) -> int:
        """Nodal diameter of the disturbance: the worst, or one of a smaller ring that grows at least half as fast."""
        worst = max(solution.nodal_diameter, 0)
        if self.ring.blades(worst) <= MOST_BLADES or self.ring.blades_apart is not None:
            return worst
        found = self._patterns(solution).worst_of_few_blades(MOST_BLADES)
        return found.nodal_diameter if found.exponent.real >= ENOUGH * solution.growth_rate else worst

    def _patterns(self, solution: Solution) -> RingPatterns:
        return RingPatterns(self.ring, self.options, solution.omega, solution.displacement)


def counts(motion: RingMotion) -> bool:
    """Whether a motion is one of the ring and no transient: it has settled, or kept its height for long."""
    return motion.settled or motion.persistence >= PERSISTENT


def at_the_end(envelope: Array, repeats: int) -> tuple[float, float]:
    """Height of a motion that repeats after some periods, and how far it may still change as a disturbance decays.

    Shapes: `envelope` (P, q), m.
    """
    heights = envelope.max(axis=1)
    heights = heights[len(heights) % repeats :].reshape(-1, repeats).max(axis=1)[::-1]
    half = WINDOW // (2 * repeats)
    last, before = (float(np.abs(heights[: part * half] - heights[0]).max()) for part in (1, 2))
    grows = before / last - 1.0 if last > 0.0 else math.inf  # of a geometric series, backwards
    return float(heights[0]), MARGIN * last / max(grows - 1.0, 1.0 / SLOWEST - 1.0)


def recurrence(motion: RingMotion) -> float:
    """Periods of 1000 in which a blade comes within 5 % of the height of a motion."""
    high = motion.envelope_m.max(axis=1) >= (1.0 - RECURS) * motion.amplitude_m
    return 1000.0 * float(high.mean())


def what_persists(envelope: Array) -> Array:
    """The last periods of a motion, from where it keeps its height: half of it as long, it comes near it again.

    Shapes: `envelope` (P, q), m.
    """
    while len(envelope) >= PERSISTENT:
        half = envelope[len(envelope) // 2 :]
        if half.max() >= KEEPS * envelope.max():
            break
        envelope = half
    return envelope
