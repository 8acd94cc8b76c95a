"""Linear segments of a curve, on which no contact changes its state: which ones there are, and their equations."""

from dataclasses import dataclass, field

import numpy as np

from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.continuation.linear_segment_system import LinearSegmentSystem
from nonlinear.continuation.solution_point import LinearState
from nonlinear.harmonic_balance.residual import HarmonicBalance

NEGLIGIBLE_HARMONICS = 1e-12  # higher harmonics below this part of the displacement are round-off


@dataclass(frozen=True)
class LinearSegments:
    """The linear solutions of a balance: every node open, or pressed and stuck with its slider at rest.

    A node without friction slides. A node with a friction cone counts as stuck where bounds of its tangential motion
    and of its load imply it; these fail a little before the node slips.

    Attributes
    ----------
    balance : HarmonicBalance
        The equations.
    contact : ContactParameters
        Parameters of the contact nodes.
    """

    balance: HarmonicBalance
    contact: ContactParameters
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

    def state(self, displacement: Array) -> LinearState | None:
        """The linear state of a motion (2H+1, n_c, 3); None if a contact opens, closes or slips in it."""
        if displacement.shape[0] > 3:
            scale = float(np.abs(displacement).max())
            if np.abs(displacement[3:]).max() > NEGLIGIBLE_HARMONICS * scale:
                return None
        load = self.contact.load_coefficients(displacement)
        mean, amplitude = load[0], np.hypot(load[1], load[2])
        if (np.abs(mean) < amplitude).any():
            return None
        state = LinearState(mean > 0.0)
        return state if self.system(state).margin(displacement) >= 0.0 else None
