"""Perturbations of one periodic solution: the worst of all nodal diameters, and the worst that few blades carry."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.parameters import Array
from nonlinear.options import SolverOptions
from nonlinear.stability.floquet import FloquetAnalysis
from nonlinear.stability.ring_stability import (
    LinearisedContact,
    PatternExponent,
    RingStability,
    largest_nodal_diameter,
)
from nonlinear.time_integration.ring import Ring

NEARLY = 0.9  # share of a growth rate that counts as nearly as fast


@dataclass(frozen=True)
class RingPatterns:
    """Floquet exponents of a periodic solution by nodal diameter.

    Attributes
    ----------
    ring : Ring
        The ring.
    options : SolverOptions
        Contact integration.
    omega : float
        Excitation frequency, rad/s.
    displacement : (2H+1, n_c, 3) float
        Real Fourier coefficients of d, m.

    Examples
    --------
    With the names of the example of `forced_response`.

    A stuck contact leaves the damping of the mass: c / 2 = zeta w = 0.01 1/s.

    >>> from nonlinear import Ring, RingPatterns
    >>> motion = np.zeros((3, 1, 3))
    >>> motion[1, 0, 0] = 0.1
    >>> patterns = RingPatterns(Ring(modal, contact, excitation), options, 1.9, motion)
    >>> round(patterns.growth_rate(0), 6)
    -0.01
    """

    ring: Ring
    options: SolverOptions
    omega: float
    displacement: Array

    def growth_rate(self, nodal_diameter: int) -> float:
        """Largest growth rate of perturbations of one nodal diameter, 1/s.

        Parameters
        ----------
        nodal_diameter : int
            k of the perturbations.
        """
        found = self._analysis(self.ring.shift(nodal_diameter)).exponents(*self._contact)
        return float(found[0].real) if found.size else -np.inf

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

        Parameters
        ----------
        most_blades : int
            Largest number of blades.
        """
        found = [PatternExponent(complex(self.growth_rate(0)), 0)]
        if largest_nodal_diameter(self.ring.modal):
            approximate = self._stability.approximate(self._contact)
            small = [item for item in approximate if self.ring.blades(item[1]) <= most_blades]
            near = [item for item in small if item[0].real >= NEARLY * small[0][0].real]
            near = sorted(near, key=lambda item: self.ring.blades(item[1]))
            for sigma, k in near[:1]:
                start = PatternExponent(self.omega * sigma, k)
                refined = self._stability.followed(self._contact, start, climb=False)
                found += [] if refined is None else [refined]
        return max(found, key=lambda pattern: pattern.exponent.real)

    @cached_property
    def _contact(self) -> LinearisedContact:
        element = contact_element(self.ring.contact, len(self.displacement) // 2, self.options)
        return LinearisedContact(self.displacement, element.evaluate(self.displacement).jacobian, self.omega)

    @cached_property
    def _stability(self) -> RingStability:
        n_blades = self.ring.modal.n_blades
        assert n_blades is not None
        return RingStability(self._analysis(0.0), n_blades)

    def _analysis(self, kappa: float) -> FloquetAnalysis:
        receptance = self.ring.receptance(len(self.displacement) // 2)
        return FloquetAnalysis.of(receptance, self.ring.contact, kappa=kappa)
