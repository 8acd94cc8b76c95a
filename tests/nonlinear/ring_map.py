"""The map of a ring of blades over one period, by time integration: its fixed point and its multipliers.

An independent check of stability. Blades in modal coordinates, forces linear over a step, as in `ring_integration`;
beyond that a slider that touches again starts at the instant of contact inside the step, so that the map can be
differentiated.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit
from ring_integration import transition

from nonlinear import ContactParameters, HarmonicBalance, contact_cycle
from nonlinear.contact.fourier import to_complex


@njit(cache=True)
def contact_forces(trial, before, slider, right, left, laws, motion, placed, force):
    """Write relative motions, slider positions and contact forces of all pairs of faces, (blades, ...) each."""
    kn, kt, mu, v0, cone = laws
    n_blades, n_modes = trial.shape
    for j in range(n_blades):
        following = (j + 1) % n_blades
        for row in range(right.shape[0]):
            total = 0.0
            for m in range(n_modes):
                total += right[row, m] * trial[j, m] - left[row, m] * trial[following, m]
            motion[j, row] = total
        for node in range(kn.size):
            now, then = v0[node] + motion[j, 3 * node + 2], v0[node] + before[j, 3 * node + 2]
            load = kn[node] * max(now, 0.0)
            force[j, 3 * node + 2] = -load
            since = now / (now - then) if then < 0.0 < now else 0.0  # share of the step that is in contact
            if kt[node] == 0.0:
                continue
            reach, far = mu[node] * load / kt[node], 0.0
            for a in range(2):
                u = motion[j, 3 * node + a]
                start = u - since * (u - before[j, 3 * node + a]) if since > 0.0 else slider[j, node, a]
                placed[j, node, a] = start if cone else min(max(start, u - reach), u + reach)
                far += (u - placed[j, node, a]) ** 2
            for a in range(2):
                u = motion[j, 3 * node + a]
                if cone and far > reach**2:
                    placed[j, node, a] = u - reach / np.sqrt(far) * (u - placed[j, node, a])
                force[j, 3 * node + a] = -kt[node] * (u - placed[j, node, a])


@njit(cache=True)
def march(matrices, right, left, external, laws, eta, rate, slider):
    """Advance eta, rate (blades, modes) and slider (blades, n_c, 2) in place by one period of `external`."""
    n_blades, n_modes = eta.shape
    motion = np.zeros((n_blades, right.shape[0]))
    before, force, placed = motion.copy(), motion.copy(), slider.copy()
    trial, total, last = eta.copy(), np.zeros_like(eta), np.zeros_like(eta)
    steps = external.shape[0]
    contact_forces(eta, motion, slider, right, left, laws, before, placed, force)
    for step in range(steps + 1):
        for _iteration in range(40):
            contact_forces(trial, before, slider, right, left, laws, motion, placed, force)
            change, size = 0.0, 0.0
            for j in range(n_blades):
                for m in range(n_modes):
                    value = external[step % steps, j, m]
                    for row in range(right.shape[0]):
                        value += right[row, m] * force[j, row] - left[row, m] * force[j - 1, row]
                    change, size = max(change, abs(value - total[j, m])), max(size, abs(value))
                    total[j, m] = value
                    if step > 0:
                        known = matrices[m, 0, 0] * eta[j, m] + matrices[m, 0, 1] * rate[j, m]
                        trial[j, m] = known + matrices[m, 0, 2] * last[j, m] + matrices[m, 0, 3] * value
            if step == 0 or change < 1e-13 * size:
                break
        for j in range(n_blades):
            for m in range(n_modes):
                if step > 0:
                    known = matrices[m, 1, 0] * eta[j, m] + matrices[m, 1, 1] * rate[j, m]
                    rate[j, m] = known + matrices[m, 1, 2] * last[j, m] + matrices[m, 1, 3] * total[j, m]
                    eta[j, m] = trial[j, m]
                last[j, m] = total[j, m]
        slider[:], before[:] = placed, motion


@dataclass(frozen=True)
class RingMap:
    """State (2 blades modes + 2 blades n_c,) of the ring after one period; `steps` a period."""

    balance: HarmonicBalance
    contact: ContactParameters
    omega: float
    n_blades: int
    steps: int = 1000

    @cached_property
    def _arguments(self):
        modal, receptance = self.balance.receptance.modal, self.balance.receptance
        theta = 2.0 * np.pi * np.arange(self.steps) / self.steps
        wave = np.cos(theta[:, None] + receptance.phase * np.arange(self.n_blades))
        external = wave[:, :, None] * (receptance.force * modal.force) + modal.static_force
        matrices = transition(modal.angular_frequency, modal.damping, 2.0 * np.pi / self.omega / self.steps)
        left = np.zeros_like(modal.right) if modal.left is None else modal.left
        c = self.contact
        laws = (c.normal_stiffness, c.tangential_stiffness, c.friction, c.interference, c.law == "cone")
        return matrices, np.ascontiguousarray(modal.right), np.ascontiguousarray(left), external, laws

    @property
    def positions(self) -> int:
        """Number of modal coordinates of the ring."""
        return self.n_blades * self.balance.receptance.modal.angular_frequency.size

    def __call__(self, state):
        """The state one period later."""
        n = self.positions
        eta, rate = (part.reshape(self.n_blades, -1).copy() for part in (state[:n], state[n : 2 * n]))
        slider = state[2 * n :].reshape(self.n_blades, -1, 2).copy()
        march(*self._arguments, eta, rate, slider)
        return np.concatenate([eta.ravel(), rate.ravel(), slider.ravel()])

    def start(self, unknown):
        """The state of the wave that solves the balance."""
        balance, modal = self.balance, self.balance.receptance.modal
        real = balance.forces(unknown).force
        coordinates, _ = balance.receptance.modal_response(self.omega, to_complex(real.reshape(real.shape[0], -1)))
        displacement = to_complex(balance.displacement(unknown))
        order = np.arange(len(coordinates))
        phases = np.exp(1j * np.outer(np.arange(self.n_blades) * balance.receptance.phase, order))
        eta = np.einsum("jh,hm->jm", phases, coordinates).real
        rate = np.einsum("jh,h,hm->jm", phases, 1j * order * self.omega, coordinates).real
        slider = np.zeros((self.n_blades, modal.n_contacts, 2))
        kt = np.where(self.contact.tangential_stiffness > 0.0, self.contact.tangential_stiffness, 1.0)
        for blade in range(self.n_blades):
            cycle = contact_cycle(displacement * phases[blade][:, None, None], self.contact, samples=4096)
            slider[blade] = cycle.displacement[0, :, :2] - cycle.force[0, :, :2] / kt[:, None]
        return np.concatenate([eta.ravel(), rate.ravel(), slider.ravel()])

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
            # sliders that stick for ever may stand anywhere: least squares leave them
            state = state + np.linalg.lstsq(np.eye(state.size) - jacobian, mismatch, rcond=1e-9)[0]
        raise AssertionError("no periodic motion found")

    def exponents(self, jacobian):
        """Floquet exponents in units of w from the multipliers, the least stable first; fast decay left out."""
        multipliers = np.linalg.eigvals(jacobian)
        found = np.log(multipliers[np.abs(multipliers) > 1e-2].astype(complex)) / (2.0 * np.pi)
        return found[np.argsort(-found.real)]
