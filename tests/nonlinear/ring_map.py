"""The map of a ring of blades over one period, by time integration: its fixed point and its multipliers.

An independent check of stability.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nonlinear import ContactParameters, Excitation, HarmonicBalance, Ring, RingIntegrator, RingState
from nonlinear.time_integration.ring import RetainedModes


@dataclass(frozen=True)
class RingMap:
    """State (2 blades modes + 2 blades n_c,) of the ring after one period; `steps` a period."""

    balance: HarmonicBalance
    contact: ContactParameters
    omega: float
    n_blades: int
    steps: int = 1000

    @cached_property
    def integrator(self) -> RingIntegrator:
        """Time integration of the ring with all its modes."""
        receptance = self.balance.receptance
        modal = receptance.modal
        engine_order = round(receptance.phase * (modal.n_blades or 1) / (2.0 * np.pi))
        ring = Ring(modal, self.contact, Excitation(engine_order, receptance.force))
        modes = RetainedModes(ring, np.inf)
        return RingIntegrator(ring, self.omega, self.n_blades, self.steps, modes)

    @property
    def positions(self) -> int:
        """Number of modal coordinates of the ring."""
        return self.n_blades * self.balance.receptance.modal.angular_frequency.size

    def __call__(self, state):
        """The state one period later."""
        n = self.positions
        eta, rate = (part.reshape(self.n_blades, -1) for part in (state[:n], state[n : 2 * n]))
        slider = state[2 * n :].reshape(self.n_blades, -1, 2)
        after = self.integrator.march(RingState(eta, rate, slider, self._force(eta, slider)), 1).final
        return np.concatenate([part.ravel() for part in (after.coordinates, after.rates, after.slider)])

    def _force(self, eta, slider):
        """Contact forces (blades, n_c, 3) that belong to modal coordinates and slider positions."""
        modal, contact = self.balance.receptance.modal, self.contact
        motion = eta @ modal.right.T - np.roll(eta, -1, axis=0) @ modal.left.T
        motion = motion.reshape(self.n_blades, -1, 3)
        load = contact.normal_load(motion[:, :, 2])
        traction = contact.tangential_stiffness[:, None] * (motion[:, :, :2] - slider)
        limit = (contact.friction * load)[:, :, None]
        if contact.law == "cone":
            size = np.linalg.norm(traction, axis=2, keepdims=True)
            traction = traction * np.minimum(1.0, limit / np.maximum(size, 1e-300))
        else:
            traction = np.clip(traction, -limit, limit)
        return -np.concatenate([traction, (load - contact.preload)[:, :, None]], axis=2)

    def start(self, unknown):
        """The state of the wave that solves the balance."""
        state = self.integrator.on_wave(self.balance.displacement(unknown))
        return np.concatenate([part.ravel() for part in (state.coordinates, state.rates, state.slider)])

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
