"""Time integration of the ring from an unstable solution of a curve, with few blades where few suffice."""

from dataclasses import dataclass

import numpy as np

from nonlinear.contact.fourier import to_real
from nonlinear.contact.parameters import Array
from nonlinear.options import SolverOptions
from nonlinear.response_curve import ResponseCurve
from nonlinear.time_integration.ring import Ring
from nonlinear.time_integration.ring_motion import RingLimits, RingMotion, integrate_ring
from nonlinear.worst_motion.ring_patterns import RingPatterns

MOST_BLADES = 8  # of a ring that is preferred to a larger one
ENOUGH = 0.5  # share of the largest growth rate that the pattern of a smaller ring needs to have
FEWEST_PERIODS = 150  # in which a ring leaves and settles, if it does so fast
MOST_PERIODS = 1000
WINDOW, SETTLING = 40, 48  # periods, see RingLimits
VISIBLE = 0.02  # disturbance relative to the vibration, where no growth rate is to be measured


@dataclass(frozen=True)
class Solution:
    """A periodic solution of the balance at one frequency.

    Attributes
    ----------
    omega : float
        Excitation frequency, rad/s.
    displacement : (2H+1, n_c, 3) float
        Real Fourier coefficients of d, m.
    growth_rate : float
        Largest growth rate of a perturbation, 1/s.
    nodal_diameter : int
        k of that perturbation; below 0: not known.
    """

    omega: float
    displacement: Array
    growth_rate: float
    nodal_diameter: int

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

    def __call__(self, solution: Solution, blade_periods: int, floor_m: float) -> RingMotion | None:
        """The motion that the ring reaches from a solution disturbed in a pattern that grows.

        Parameters
        ----------
        solution : Solution
            Where the ring starts.
        blade_periods : int
            Number of periods times number of blades that may be integrated.
        floor_m : float
            Amplitude below which the ring is not followed, m.

        Returns
        -------
        RingMotion or None
            None where that is too little for a ring of so many blades.

        Raises
        ------
        ArithmeticError
            The time integration failed.
        """
        pattern = self.pattern(solution)
        periods = min(MOST_PERIODS, blade_periods // self.ring.blades(pattern))
        if periods < FEWEST_PERIODS:
            return None
        limits = RingLimits(
            most_periods=periods, disturbance=VISIBLE, floor_m=floor_m, window=WINDOW, settling=SETTLING
        )
        return self._motion(solution, pattern, limits)

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
        patterns = RingPatterns(self.ring, self.options, solution.omega, solution.displacement)
        found = patterns.worst_of_few_blades(MOST_BLADES)
        return found.nodal_diameter if found.exponent.real >= ENOUGH * solution.growth_rate else worst
