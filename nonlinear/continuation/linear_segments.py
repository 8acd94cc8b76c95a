"""Linear segments of a curve, on which no contact changes its state: which ones there are, and their equations."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.parameters import SLIP, Array, ContactParameters
from nonlinear.continuation.linear_segment_system import LinearSegmentSystem
from nonlinear.continuation.solution_point import LinearState, SolutionPoint
from nonlinear.harmonic_balance.residual import HarmonicBalance

NEGLIGIBLE_HARMONICS = 1e-12  # higher harmonics below this part of the displacement are round-off


@dataclass(frozen=True)
class LinearSegments:
    """The linear solutions of a balance: every node open, or pressed and stuck with its slider at rest.

    A node without friction slides. A node with a friction cone counts as stuck where bounds of its tangential motion
    and of its load imply it; these fail a little before the node slips.
    """

    balance: HarmonicBalance  # the equations
    contact: ContactParameters  # parameters of the contact nodes
    _systems: dict[bytes, LinearSegmentSystem] = field(default_factory=dict, init=False, repr=False, compare=False)

    def system(self, state: LinearState) -> LinearSegmentSystem:
        """The equations in one state of the contacts."""
        key = state.pressed.tobytes()
        if key not in self._systems:
            self._systems[key] = LinearSegmentSystem(self.balance, self.contact, state)
        return self._systems[key]

    def uniform(self) -> tuple[LinearSegmentSystem, LinearSegmentSystem]:
        """All contacts open, and all pressed together."""
        every = np.ones(self.balance.n_contacts, dtype=bool)
        return self.system(LinearState(~every)), self.system(LinearState(every))

    def state_at(self, point: SolutionPoint) -> LinearState | None:
        """The linear state of a solved point: known, or that of its motion; None where a node slips."""
        if point.linear is not None:
            return point.linear
        if (self.contact.can_stick & (point.contact.state == SLIP)).any():
            return None
        return self.state(point.displacement)

    def state(self, displacement: Array) -> LinearState | None:
        """The linear state of a motion (2H+1, n_c, 3); None if a contact opens, closes or slips in it."""
        highest = self.balance.receptance.excited_harmonics[-1]
        if displacement.shape[0] > 2 * highest + 1:
            scale = float(np.abs(displacement).max())
            if np.abs(displacement[2 * highest + 1 :]).max() > NEGLIGIBLE_HARMONICS * scale:
                return None
        load = self.contact.load_coefficients(displacement)
        if highest > 1:
            return self._state_of_several(displacement, load[0] > 0.0)
        mean, amplitude = load[0], np.hypot(load[1], load[2])
        if (np.abs(mean) < amplitude).any():
            return None
        state = LinearState(mean > 0.0)
        return state if self.system(state).margin(displacement) >= 0.0 else None

    def _state_of_several(self, displacement: Array, pressed: NDArray[np.bool_]) -> LinearState | None:
        """As `state`, for several harmonics; those of them that are not excited must be negligible too."""
        excited = self.balance.receptance.excited_harmonics
        others = [h for h in range(1, excited[-1]) if h not in excited]
        rows = [row for h in others for row in (2 * h - 1, 2 * h)]
        scale = float(np.abs(displacement).max())
        if rows and np.abs(displacement[rows]).max() > NEGLIGIBLE_HARMONICS * scale:
            return None
        state = LinearState(pressed)
        return state if self.system(state).margin(displacement) >= 0.0 else None
