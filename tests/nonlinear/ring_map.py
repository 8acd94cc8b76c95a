"""The map of a ring of blades over one period, by time integration: its fixed point and its multipliers.

An independent check of stability.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from ring_integration import RingState, integrate_period, ring_of, state_of_wave, travelling_wave

from nonlinear import ContactParameters, HarmonicBalance
from nonlinear.contact.fourier import to_complex


@dataclass(frozen=True)
class RingMap:
    """State (2 blades modes + 2 blades n_c,) of the ring after one period; `steps` a period."""

    balance: HarmonicBalance
    contact: ContactParameters
    omega: float
    n_blades: int
    steps: int = 1000

    @property
    def modal(self):
        """The modes of a blade."""
        return self.balance.receptance.modal

    @property
    def phase(self):
        """Inter-blade phase angle."""
        return self.balance.receptance.phase

    @cached_property
    def _ring(self):
        return ring_of(self.modal, self.contact, self.omega, self.steps)

    @cached_property
    def _external(self):
        return travelling_wave(self.modal, self.phase, self.balance.receptance.force, self.n_blades, self.steps)

    @property
    def positions(self) -> int:
        """Number of modal coordinates of the ring."""
        return self.n_blades * self.modal.angular_frequency.size

    def __call__(self, state):
        """The state one period later."""
        n = self.positions
        eta, rate = (part.reshape(self.n_blades, -1).copy() for part in (state[:n], state[n : 2 * n]))
        slider = state[2 * n :].reshape(self.n_blades, -1, 2).copy()
        after = RingState(eta, rate, slider)
        integrate_period(self._ring, self._external, after, self.modal.outputs["tip"], np.empty(self.steps))
        return np.concatenate([part.ravel() for part in after])

    def start(self, unknown):
        """The state of the wave that solves the balance."""
        real = self.balance.forces(unknown).force
        force = to_complex(real.reshape(real.shape[0], -1))
        coordinates, _ = self.balance.receptance.modal_response(self.omega, force)
        wave = coordinates, to_complex(self.balance.displacement(unknown))
        state = state_of_wave(self.modal, self.contact, self.phase, self.omega, wave, self.n_blades)
        return np.concatenate([part.ravel() for part in state])

    def derivative(self, state):
        """Jacobian of the map by central differences."""
        n, size = self.positions, 1e-6 * np.abs(state[: self.positions]).max()
        step = np.full(state.size, size)
        step[n : 2 * n] *= self.omega
        columns = [(self(state + d) - self(state - d)) / (2.0 * d.sum()) for d in np.diag(step)]
        return np.array(columns).T

    def fixed_point(self, state):
        """The periodic motion of the discretised ring near `state`, and the derivative of the map there."""
        for _ in range(8):
            jacobian, mismatch = self.derivative(state), self(state) - state
            if np.abs(mismatch).max() < 1e-8 * np.abs(state).max():
                return state, jacobian
            # sliders that never slip may stand anywhere: least squares leave them
            state = state + np.linalg.lstsq(np.eye(state.size) - jacobian, mismatch, rcond=1e-9)[0]
        raise AssertionError("no periodic motion found")

    def exponents(self, jacobian):
        """Floquet exponents in units of omega from the multipliers, the least stable first; fast decay left out."""
        multipliers = np.linalg.eigvals(jacobian)
        found = np.log(multipliers[np.abs(multipliers) > 1e-2].astype(complex)) / (2.0 * np.pi)
        return found[np.argsort(-found.real)]
