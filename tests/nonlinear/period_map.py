"""The map of a ring over one period: its fixed point, and its derivative, the monodromy matrix.

The derivative is that of the time integration, by differences: no harmonics are neglected and no pole is condensed.
The eigenvalues of the monodromy matrix are the Floquet multipliers of all perturbations that the ring carries.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.time_integration.ring import RingState
from nonlinear.time_integration.ring_integrator import RingIntegrator

DIFFERENCE = 1e-6  # relative change of an unknown
# of Newton's method: matrices, iterations with each; relative change over a period that is none
MOST_MATRICES, MOST_ITERATIONS, FIXED = 4, 5, 1e-8
LOST = 1.0  # relative change over a period of a motion that is none
NEUTRAL = 1e-9  # singular value, relative to the largest, of a direction that Newton's method leaves
SMALLEST_MULTIPLIER = 1e-2  # of exponents that are told: what decays faster is lost in round-off


@dataclass(frozen=True)
class PeriodMap:
    """The state of a ring after one period, near a state.

    Unknowns are the coordinates and rates of the modes integrated, the sliders that move in the period, and contact
    forces, each in units of the largest: a slider that stands still does so in every perturbation.
    """

    integrator: RingIntegrator
    near: RingState

    @property
    def start(self) -> Array:
        """The unknowns of the state itself."""
        return self._unknowns(self.near)

    @property
    def positions(self) -> int:
        """Number of coordinates: they come first, then as many rates."""
        return int(np.count_nonzero(self._masks[0]))

    def __call__(self, unknowns: Array) -> Array:
        """The unknowns one period later."""
        changed, first = [], 0
        for part, mask, unit in zip(self._parts(self.near), self._masks, self._units, strict=True):
            last = first + int(np.count_nonzero(mask))
            whole = part.copy()
            whole[mask] = unit * unknowns[first:last]
            changed.append(whole)
            first = last
        return self._unknowns(self.integrator.march(RingState(*changed), 1).final)

    def derivative(self, unknowns: Array, after: Array) -> Array:
        """The monodromy matrix by differences from the unknowns one period later."""
        steps = DIFFERENCE * np.eye(unknowns.size)
        return np.array([(self(unknowns + step) - after) / DIFFERENCE for step in steps]).T

    def fixed_point(self, unknowns: Array) -> tuple[Array, Array]:
        """The periodic motion near some unknowns, by Newton's method with few matrices, and the monodromy matrix."""
        for _ in range(MOST_MATRICES):
            after = self(unknowns)
            matrix, moved = self.derivative(unknowns, after), False
            inverse = np.linalg.pinv(np.eye(unknowns.size) - matrix, rcond=NEUTRAL)
            for _ in range(MOST_ITERATIONS):
                if np.abs(after - unknowns).max() < FIXED:
                    return unknowns, self.derivative(unknowns, after) if moved else matrix
                if not np.abs(after - unknowns).max() < LOST:
                    raise ArithmeticError("the ring leaves the motion")
                unknowns, moved = unknowns + inverse @ (after - unknowns), True
                after = self(unknowns)
        raise ArithmeticError("no periodic motion of the ring was found")

    def exponents(self, matrix: Array) -> ComplexArray:
        """Floquet exponents of a monodromy matrix, 1/s, the least stable first; fast decay is left out."""
        multipliers = np.linalg.eigvals(matrix)
        kept = multipliers[np.abs(multipliers) > SMALLEST_MULTIPLIER].astype(complex)
        found: ComplexArray = np.log(kept) / self.integrator.period
        return found[np.argsort(-found.real)]

    def _unknowns(self, state: RingState) -> Array:
        parts = zip(self._parts(state), self._masks, self._units, strict=True)
        return np.concatenate([part[mask] / unit for part, mask, unit in parts])

    @staticmethod
    def _parts(state: RingState) -> tuple[Array, Array, Array, Array]:
        return state.coordinates, state.rates, state.slider, state.force

    @cached_property
    def _masks(self) -> tuple[NDArray[np.bool_], ...]:
        """Which values are unknowns."""
        retained = np.atleast_2d(self.integrator.structure.retained).any(axis=0)
        modes = np.broadcast_to(retained, self.near.coordinates.shape)
        sliders = np.array([state.slider for state in self._period])
        moving = np.ptp(sliders, axis=0) > DIFFERENCE * self._units[2]
        return modes, modes, moving, np.ones(self.near.force.shape, dtype=bool)

    @cached_property
    def _units(self) -> tuple[float, ...]:
        """The largest value of each kind in a period: at one instant contacts may be open, or the blades at rest."""
        parts = zip(*map(self._parts, [self.near, *self._period]), strict=True)
        coordinates, _, slider, force = (max(float(np.abs(part).max()), 1e-300) for part in map(np.array, parts))
        return coordinates, self.integrator.omega * coordinates, slider, force

    @cached_property
    def _period(self) -> list[RingState]:
        return self.integrator.history(self.near)[0]
