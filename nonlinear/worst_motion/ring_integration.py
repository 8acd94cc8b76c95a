"""Time integration of the ring from an unstable solution of a curve, with few blades where few suffice."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from nonlinear.contact.fourier import to_real
from nonlinear.contact.parameters import Array
from nonlinear.options import SolverOptions
from nonlinear.response_curve import ResponseCurve
from nonlinear.time_integration.ring import Ring
from nonlinear.time_integration.ring_integrator import RingIntegrator
from nonlinear.time_integration.ring_motion import RingLimits, RingMotion, integrate_ring
from nonlinear.worst_motion.ring_patterns import RingPatterns

MOST_BLADES = 8  # of a ring that is preferred to a larger one
ENOUGH = 0.5  # share of the largest growth rate that the pattern of a smaller ring needs to have
FEWEST_PERIODS = 200  # in which a ring leaves and settles, if it does so fast
USUAL_PERIODS = 300  # in which it usually does
MOST_PERIODS = 1000
WINDOW, SETTLING = 40, 48  # periods, see RingLimits
LONGER = 240  # periods for which the highest motion so far is followed on
FOLLOWED = 0.05  # disturbance then, relative to the vibration
FALLS, CLIMBS = 0.85, 1.3  # ratios of its largest displacements then and before, beyond which it does not persist
SPREADS, SCATTER = 2.0, 0.05  # the same of its scatter, and the scatter relative to the amplitude that is none
FLOOR = 0.7  # of the highest motion known, below which a ring is not followed
VISIBLE = 0.02  # disturbance relative to the vibration, where no growth rate is to be measured


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
    """Time integration from solutions of one curve.

    Attributes
    ----------
    ring : Ring
        The ring.
    options : SolverOptions
        Options of the curve.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from nonlinear import Ring, RingIntegration, SolutionSearch
    >>> ring = Ring(modal, contact, excitation)
    >>> found = SolutionSearch(ring, options, frequency_hz=0.198).solutions([curve])
    >>> RingIntegration(ring, options).motion(found[0].solution, most_periods=400).stays
    True
    """

    ring: Ring
    options: SolverOptions

    def __call__(self, solution: Solution, blade_periods: int, height_m: float) -> Integrated:
        """The motion that the ring reaches from a solution disturbed in a pattern that grows.

        A pattern that needs too many blades is replaced by one that grows slower, and this is said. A motion higher
        than all that are known is followed on: what has settled beside an unstable motion may leave it late.
        """
        pattern, failure = self.pattern(solution), ""
        blades = self.ring.blades(pattern)
        if blade_periods < USUAL_PERIODS * blades and blades > MOST_BLADES:
            found = self._patterns(solution).worst_of_few_blades(MOST_BLADES)
            if found.grows(solution.omega):
                pattern, failure = found.nodal_diameter, f"of {blades} blades would take too long"
        if blade_periods < FEWEST_PERIODS * self.ring.blades(pattern):
            return Integrated(None, f"of {blades} blades would take too long")
        limits = RingLimits(
            most_periods=min(MOST_PERIODS, blade_periods // self.ring.blades(pattern)),
            disturbance=VISIBLE,
            floor_m=FLOOR * height_m,
            window=WINDOW,
            settling=SETTLING,
        )
        motion = self._motion(solution, pattern, limits)
        if motion.settled and not motion.stays and motion.amplitude_m > height_m:
            motion = self._followed_on(solution, motion)
        return Integrated(motion, failure)

    def _followed_on(self, solution: Solution, motion: RingMotion) -> RingMotion:
        """A motion that has settled, disturbed and followed for longer; its largest displacement, if it persists.

        In a ring of a multiple of its blades, if that is no large one.
        """
        pattern, state = self._larger(motion), motion.final
        integrator = RingIntegrator.of(self.ring, solution.omega, nodal_diameter=pattern)
        if integrator.n_blades > motion.n_blades:
            state = state.repeated(integrator.n_blades)
        disturbed = integrator.disturbed(state, pattern, FOLLOWED * integrator.vibration(state))
        record = integrator.march(disturbed, LONGER)
        before, after = np.array_split(record.envelope_m[WINDOW:], 2)  # without what decays at first
        return replace(
            motion,
            settled=_persists(motion.amplitude_m, before, after),
            amplitude_m=max(motion.amplitude_m, float(after.max())),
            lowest_m=min(motion.lowest_m, float(after.min())),
            n_blades=integrator.n_blades,
            periods=motion.periods + LONGER,
            envelope_m=record.envelope_m,
            final=record.final,
        )

    def _larger(self, motion: RingMotion) -> int:
        """Nodal diameter that the largest ring carries of a multiple of the blades of a motion that are not many."""
        blades = {motion.n_blades: motion.nodal_diameter}
        for k in range(1, (self.ring.modal.n_blades or 0) // 2 + 1):
            number = self.ring.blades(k)
            if number <= MOST_BLADES and number % motion.n_blades == 0:
                blades.setdefault(number, k)
        return blades[max(blades)]

    def motion(self, solution: Solution, most_periods: int) -> RingMotion:
        """The same within a number of periods, however many blades, and with the growth rate of a small disturbance.

        Parameters
        ----------
        solution : Solution
            Where the ring starts.
        most_periods : int
            Number of periods that may be integrated.

        Raises
        ------
        ArithmeticError
            The time integration failed.
        """
        return self._motion(solution, self.pattern(solution), RingLimits(most_periods=most_periods))

    def _motion(self, solution: Solution, pattern: int, limits: RingLimits) -> RingMotion:
        start = solution.displacement
        return integrate_ring(self.ring, solution.omega, start, nodal_diameter=pattern, limits=limits)

    def pattern(self, solution: Solution) -> int:
        """Nodal diameter of the disturbance: the worst, or one of a smaller ring that grows at least half as fast.

        Parameters
        ----------
        solution : Solution
            Where the ring starts.
        """
        worst = max(solution.nodal_diameter, 0)
        if self.ring.blades(worst) <= MOST_BLADES:
            return worst
        found = self._patterns(solution).worst_of_few_blades(MOST_BLADES)
        return found.nodal_diameter if found.exponent.real >= ENOUGH * solution.growth_rate else worst

    def _patterns(self, solution: Solution) -> RingPatterns:
        return RingPatterns(self.ring, self.options, solution.omega, solution.displacement)


def _persists(amplitude: float, before: Array, after: Array) -> bool:
    """Whether a motion of an amplitude keeps its height and scatter, in two windows (P, q) after a disturbance."""
    keeps_height = after.max() >= FALLS * amplitude and max(before.max(), after.max()) <= CLIMBS * amplitude
    spread = [float(window.max() - window.min()) for window in (before, after)]
    return bool(keeps_height and spread[1] <= SPREADS * spread[0] + SCATTER * amplitude)
