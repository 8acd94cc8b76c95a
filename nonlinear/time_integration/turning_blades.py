"""Blades with Coriolis forces that only their contacts join, in time: the poles of a blade in place of its modes."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nonlinear.contact.parameters import Array
from nonlinear.time_integration.contact_step import BladeSystem, TurningWaves, padded
from nonlinear.time_integration.ring_structure import BladeKernel, ClampedBlades
from nonlinear.time_integration.wave_poles import WavePoles


@dataclass(frozen=True)
class TurningBlades(ClampedBlades):
    """Coordinates (q, m) of q blades, alike, with Coriolis forces; the kernels hold poles, and no rates."""

    @cached_property
    def poles(self) -> WavePoles:
        """Those of a blade."""
        return WavePoles.of(self.modal, self.modal.angular_frequency.size, self.modes, True)

    def packed(self, values: Array) -> Array:
        """Modal forces (q, m) as the kernels hold them."""
        return padded(values @ self._of_rates.T, 1)

    def packed_state(self, coordinates: Array, rates: Array) -> tuple[Array, Array]:
        """The retained part of coordinates (q, m) and rates: poles, and zeros."""
        of_coordinates = self.poles.of_coordinates(self.poles.half).real
        found = padded(coordinates @ of_coordinates.T + rates @ self._of_rates.T, 1)
        return found, np.zeros_like(found)

    def unpacked_state(self, kept: Array, rates: Array) -> tuple[Array, Array]:
        """Coordinates (..., q, m) and rates of the poles."""
        poles = kept[..., : 2 * self.poles.half]
        return poles @ self._of_poles(1).T, poles @ self._of_poles(2).T

    def following(self, force: Array) -> tuple[Array, Array]:
        """Coordinates and rates (q, m) of the poles that follow modal forces (q, m) at once."""
        taken = force @ self._of_rates.T  # the static response of all poles is f / k, the sum of all x l is 0
        return force / self.modal.held_stiffness + taken @ self._of_poles(0).T, taken @ self._of_poles(1).T

    def kernel(self, omega: float, steps: int) -> BladeKernel:
        """The kernel that marches the ring at `omega` (rad/s) with `steps` a period."""
        ring, poles, half = self.modes.ring, self.poles, self.poles.half
        right, left = self.faces
        coefficients, at_end, follows = poles.over_step(2.0 * np.pi / omega / steps)
        moved, taken = (
            [face @ poles.shapes for face in (right, left)],
            [poles.of_rates @ face.T for face in (right, left)],
        )

        def under_forces(motion: int, force: int) -> Array:  # rows are those of the force
            return ((moved[motion] * at_end) @ taken[force]).real.T

        near = under_forces(0, 0) + under_forces(1, 1), -under_forces(0, 1), -under_forces(1, 0)
        output = self.modal.outputs[ring.output]
        follow = ((output @ poles.shapes) * follows) @ np.stack(taken, axis=1).reshape(len(follows), -1)
        by_right, by_left = follow.real.reshape(2, -1)
        shapes, of_rates = self._of_poles(1), self._of_rates
        position = padded(poles.slots(coefficients, half, 0.0), 1)
        blades = BladeSystem(
            right=padded(right @ of_rates.T, 2),
            left=padded(left @ of_rates.T, 2),
            right_modes=padded((right @ shapes).T, 2),
            left_modes=padded((left @ shapes).T, 2),
            output_modes=padded(output @ shapes, 1),
            push=padded(of_rates @ self.push, 1),
            output_forces=padded(np.stack([by_right, -by_left])[None], 1),
        )
        propagated = position.real[None], np.zeros(position.shape)[None]
        imaginary = np.stack([position.imag, np.zeros(position.shape)])
        system = self.system(omega, propagated, [each[None] for each in near])
        return BladeKernel(system, blades, TurningWaves(imaginary, np.zeros((2, 0)), half))

    @cached_property
    def _of_rates(self) -> Array:
        """Slots of unit rates, and of unit forces, (k, m)."""
        return self.poles.slots(self.poles.of_rates.T, self.poles.half, -1.0).T.real

    def _of_poles(self, order: int) -> Array:
        """Coordinates of the slots, (m, k), `order` 1; their rates, 2; what they are over the poles, 0."""
        return self.poles.slots(self.poles.shapes * self.poles.values ** (order - 1), self.poles.half, 1.0).real
