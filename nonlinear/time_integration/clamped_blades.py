"""A ring of blades on a rigid disk: each has its own modal coordinates, and only the contacts join them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.parameters import Array
from nonlinear.time_integration.modal_propagation import propagation
from nonlinear.time_integration.residual_flexibility import RetainedModes
from nonlinear.time_integration.ring_period import march_steps
from nonlinear.time_integration.ring_system import RingSystem, RingWork, cosine_rows, node_law
from rom import ModalModel


@dataclass(frozen=True)
class ClampedBlades:
    """Coordinates (q, m) of q blades: the modal coordinates of each."""

    modal: ModalModel  # modes of a blade
    modes: RetainedModes  # modes that are integrated
    n_blades: int  # number q of blades

    @property
    def angular_frequency(self) -> Array:
        """Natural frequencies, (m,), rad/s."""
        return self.modal.angular_frequency

    @property
    def damping(self) -> Array:
        """Modal damping coefficients 2 zeta w, (m,), 1/s."""
        return self.modal.damping

    @property
    def retained(self) -> NDArray[np.bool_]:
        """Modes that are integrated, (m,)."""
        return self.modes.are_retained(self.angular_frequency)

    def scaled(self, coordinates: Array, factor: NDArray[Any]) -> Array:
        """Coordinates (..., q, m) times a factor (m,) of each mode."""
        return coordinates * factor

    def packed(self, coordinates: Array) -> Array:
        """The retained ones of coordinates (q, m), as the kernels hold them."""
        return np.ascontiguousarray(coordinates[:, self.retained])

    def unpacked(self, kept: Array) -> Array:
        """Coordinates (q, m) from those of the kernels; 0 where a mode is not retained."""
        coordinates = np.zeros((self.n_blades, self.angular_frequency.size))
        coordinates[:, self.retained] = kept
        return coordinates

    def motion(self, coordinates: Array) -> Array:
        """Relative displacement (..., q, r) of the pairs of faces, m."""
        motion = coordinates @ self.modal.right.T
        if self.modal.left is not None:
            motion = motion - np.roll(coordinates, -1, axis=-2) @ self.modal.left.T
        return motion

    def modal_force(self, force: Array) -> Array:
        """Modal forces (q, m) of contact forces (q, r) on the right nodes."""
        found: Array = force @ self.modal.right
        if self.modal.left is not None:
            found = found - np.roll(force, 1, axis=0) @ self.modal.left
        return found

    def kernel(self, omega: float, steps: int) -> "BladeKernel":
        """The kernel that marches the ring at `omega` (rad/s) with `steps` a period."""
        ring, modal, kept = self.modes.ring, self.modal, self.retained
        right, flexibility = modal.right, self.modes.flexibility(modal.angular_frequency)
        left = np.zeros_like(right) if modal.left is None else modal.left
        if self.n_blades == 1:  # its own neighbour
            right, left = right - left, np.zeros_like(left)
        position, rate = propagation(modal.angular_frequency[kept], modal.damping[kept], 2.0 * np.pi / omega / steps)
        at_end = flexibility.copy()
        at_end[kept] = position[3]
        own = (right * at_end) @ right.T + (left * at_end) @ left.T
        previous = -(left * at_end) @ right.T  # [force, motion]
        following = -(right * at_end) @ left.T
        linear = ring.excited
        coordinates = ring.free_response(omega)
        output = modal.outputs[ring.output]
        angles = ring.phase * np.arange(self.n_blades)
        system = RingSystem(
            position=position,
            rate=rate,
            right=np.ascontiguousarray(right[:, kept]),
            left=np.ascontiguousarray(left[:, kept]),
            right_modes=np.ascontiguousarray(right[:, kept].T),
            left_modes=np.ascontiguousarray(left[:, kept].T),
            own=np.ascontiguousarray(own),
            previous=np.ascontiguousarray(previous),
            following=np.ascontiguousarray(following),
            free_motion=cosine_rows(np.einsum("hrm,hm->hr", linear.relative, coordinates)),
            free_output=cosine_rows(linear.output(ring.output, coordinates)),
            output_modes=np.ascontiguousarray(output[kept]),
            output_forces=np.stack([right, -left]) @ (flexibility * output),
            waves=np.stack([np.cos(angles), np.sin(angles)], axis=1),
            contact=node_law(ring.contact),
        )
        return BladeKernel(system)


@dataclass(frozen=True)
class BladeKernel:
    """Marches a ring of blades; `system` holds the arrays."""

    system: RingSystem

    def __call__(self, work: RingWork, first: int, last: int, scale: float, output: Array) -> float:
        """March steps of a period, see `march_steps`."""
        return float(march_steps(self.system, work, first, last, scale, output))
