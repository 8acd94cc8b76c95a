"""Stretches of a curve on which no contact changes its state: one linear solution a frequency, and where they end."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nonlinear.balance import HarmonicBalance
from nonlinear.contact import LIFT_OFF, SLIP, STICK, Array, ContactForces, ContactParameters
from nonlinear.curve_point import LinearState
from nonlinear.fourier import ComplexArray
from rom import RelativeReceptance

NO_VIBRATION = 1e-12  # higher harmonics below this part of the displacement are round-off


@dataclass(frozen=True)
class LinearStretches:
    """The linear solutions of a `balance`: every node open, or pressed and stuck with its slider at rest.

    A node without friction slides; a node of the coupled law counts as stuck where that follows from bounds of its
    tangential motion and of its load, which is a little sooner left than its stick.
    """

    balance: HarmonicBalance
    contact: ContactParameters

    @cached_property
    def _receptance(self) -> RelativeReceptance:
        """Of harmonic 1."""
        return replace(self.balance.receptance, harmonics=(1,))

    @cached_property
    def _held(self) -> NDArray[np.bool_]:
        """Nodes whose friction can hold them, (n_c,)."""
        return (self.contact.tangential_stiffness > 0.0) & (self.contact.friction > 0.0)

    def state(self, displacement: Array) -> LinearState | None:
        """The linear state of a motion (2H+1, n_c, 3); None if a contact opens, closes or slips in it."""
        scale = float(np.abs(displacement).max())
        if displacement.shape[0] > 3 and np.abs(displacement[3:]).max() > NO_VIBRATION * scale:
            return None
        mean, swing = self._load(displacement)
        state = LinearState((mean > 0.0) & (mean >= swing))
        return state if self.margin(state, displacement) >= 0.0 else None

    def margin(self, state: LinearState, displacement: Array) -> float:
        """Distance (m) of the motion from the nearest change of a contact's state; negative beyond it.

        Closed form for one harmonic: c_0 + |c_1| is the largest value of c_0 + Re c_1 exp(i theta).
        """
        mean, swing = self._load(displacement)
        stiffness = np.where(self.contact.normal_stiffness > 0.0, self.contact.normal_stiffness, 1.0)
        room = np.where(state.pressed, mean - swing, -mean - swing) / stiffness
        least = float(room.min())
        held = state.pressed & self._held
        if not held.any():
            return least
        reach = self.contact.friction[held] / self.contact.tangential_stiffness[held]
        static, vibration = displacement[0, held, :2], _complex(displacement)[held, :2]
        if self.contact.law == "coupled":
            farthest = np.linalg.norm(np.abs(static) + np.abs(vibration), axis=1)
            return min(least, float((reach * (mean - swing)[held] - farthest).min()))
        load = self.contact.normal_stiffness[held] * _complex(displacement)[held, 2]
        for sign in (1.0, -1.0):
            swings = np.abs(vibration - (sign * reach * load)[:, None])
            room = (reach * mean[held])[:, None] - sign * static - swings
            least = min(least, float(room.min()))
        return least

    def _load(self, displacement: Array) -> tuple[Array, Array]:
        """Mean and amplitude of N0 + kn (v0 + d_n), N, each (n_c,)."""
        stiffness = self.contact.normal_stiffness
        mean = self.contact.preload + stiffness * (self.contact.interference + displacement[0, :, 2])
        return mean, stiffness * np.abs(_complex(displacement)[:, 2])

    def springs(self, state: LinearState) -> Array:
        """Contact springs of a state, (n_c, 3), N/m."""
        held = (state.pressed & self._held)[:, None]
        tangential = np.where(held, self.contact.tangential_stiffness[:, None], 0.0)
        normal = np.where(state.pressed, self.contact.normal_stiffness, 0.0)
        return np.column_stack([tangential, tangential, normal])

    def static(self, state: LinearState) -> Array:
        """Harmonic 0 of a state, (n_c, 3); the same at all frequencies."""
        if self.balance.frozen_static is not None:
            return self.balance.frozen_static
        springs = self.springs(state)
        force = np.zeros_like(springs)
        force[:, 2] = self._rest_force(state)
        at_rest = replace(self.balance.receptance, harmonics=(0,))
        free, _ = at_rest.response(0.0, force.reshape(1, -1).astype(complex))
        system = np.eye(springs.size) + at_rest.matrix(0.0)[0].real * springs.reshape(-1)
        return np.linalg.solve(system, free[0].real).reshape(-1, 3)

    def _rest_force(self, state: LinearState) -> Array:
        """The normal force of a state without displacement, N0 - N, (n_c,)."""
        return np.where(
            state.pressed, -self.contact.normal_stiffness * self.contact.interference, self.contact.preload
        )

    def forces(self, state: LinearState, displacement: Array) -> ContactForces:
        """Contact forces of a motion in a state, as the contact element would give them."""
        springs = self.springs(state)
        force = -springs * displacement
        force[0, :, 2] += self._rest_force(state)
        rows = np.arange(displacement.shape[0])
        jacobian = np.zeros((springs.shape[0], 3, 3, rows.size, rows.size))
        for axis in range(3):
            jacobian[:, axis, axis, rows, rows] = -springs[:, axis, None]
        sliding = (self.contact.tangential_stiffness > 0.0) & (self.contact.friction == 0.0)
        moving = displacement[1:, :, :2].any(axis=(0, 2))
        worst = np.where(state.pressed, np.where(sliding & moving, SLIP, STICK), LIFT_OFF)
        return ContactForces(force, jacobian, worst.astype(np.int64))

    def solve(self, state: LinearState, static: Array, frequency: float) -> tuple[Array, Array]:
        """The motion (2H+1, n_c, 3) in a state at w = `frequency` (rad/s) with its harmonic 0, and d/dw of it."""
        from scipy.linalg.lapack import zgetrf, zgetrs

        springs = self.springs(state).reshape(-1)
        force = np.zeros((1, springs.size), dtype=complex)
        free, slope = self._receptance.response(frequency, force)
        motion, change = free[0], slope[0]
        if springs.any():
            system = self._receptance.matrix(frequency)[0] * springs
            system[np.diag_indices_from(system)] += 1.0
            factors, pivots, _ = zgetrf(system.T, overwrite_a=1)
            motion, _ = zgetrs(factors, pivots, motion, trans=1)
            force[0] = -springs * motion
            change, _ = zgetrs(factors, pivots, self._receptance.response(frequency, force)[1][0], trans=1)
        return self._rows(static, motion), self._rows(np.zeros_like(static), change)

    def _rows(self, static: Array, harmonic: ComplexArray) -> Array:
        rows = np.zeros((2 * len(self.balance.receptance.harmonics) - 1, *static.shape))
        rows[0] = static
        rows[1], rows[2] = harmonic.real.reshape(static.shape), harmonic.imag.reshape(static.shape)
        return rows


def _complex(displacement: Array) -> ComplexArray:
    """Harmonic 1, (n_c, 3)."""
    return displacement[1] + 1j * displacement[2]
