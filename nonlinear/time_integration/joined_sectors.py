"""A ring of sectors joined at a disk: its modes belong to waves, and a force on one sector moves all.

Waves of q sectors have the phases 2 pi l / q, l = 0 .. q - 1. In the wave l, with the modes phi_l, sector j moves as
q^(-1/2) exp(2 pi i j l / q) phi_l z_l. In a real motion z_(q-l) is the complex conjugate of z_l.

The coordinates of the ring are the sums of the waves, mode number by mode number,

    x_j = q^(-1/2) sum_l exp(2 pi i j l / q) z_l,

real, (q, m). A travelling wave on fewer sectors, repeated, is the same wave on more. If the modes were the same in
all waves, x_j would be the modal coordinates of blade j. The kernels have the cosine and sine waves, the real
discrete Fourier transform of x_j. In these the ring is one structure with real modes, in contact with itself.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.time_integration.modal_propagation import propagation
from nonlinear.time_integration.residual_flexibility import RetainedModes
from nonlinear.time_integration.ring_system import RingSystem, cosine_rows, node_law
from rom import WaveModes


@dataclass(frozen=True)
class JoinedSectors:
    """Coordinates (q, m) of q sectors: the sums of the waves.

    Factors of modes have one row for each of the J = q // 2 + 1 waves l = 0 .. q // 2.

    Attributes
    ----------
    modes : RetainedModes
        The ring, and its modes that are integrated.
    n_blades : int
        Number q of sectors.
    """

    modes: RetainedModes
    n_blades: int

    @cached_property
    def phases(self) -> Array:
        """Phases from one sector to the next, (J,), rad."""
        return 2.0 * np.pi * np.arange(self.n_blades // 2 + 1) / self.n_blades

    @cached_property
    def waves(self) -> WaveModes:
        """Modes of the waves."""
        return self.modes.ring.modal.waves(self.phases, rigid=True)

    @property
    def angular_frequency(self) -> Array:
        """Natural frequencies, (J, m), rad/s."""
        return self.waves.angular_frequency

    @property
    def damping(self) -> Array:
        """Modal damping coefficients 2 zeta w, (J, m), 1/s."""
        return self.waves.damping

    @cached_property
    def retained(self) -> NDArray[np.bool_]:
        """Modes that are integrated, (J, m)."""
        return self.modes.are_retained(self.angular_frequency)

    @cached_property
    def output(self) -> ComplexArray:
        """Output of the modes, (J, m)."""
        ring = self.modes.ring
        rows = np.zeros(self.angular_frequency.shape, dtype=complex)
        for row, phase in zip(rows, self.phases, strict=True):
            own = ring.modal.at_phase(float(phase)).outputs[ring.output]
            row[: own.size] = own
        return rows

    def scaled(self, coordinates: Array, factor: NDArray[Any]) -> Array:
        """Coordinates (..., q, m) times a factor (J, m) of each mode."""
        return self._in_time(self._in_waves(coordinates) * factor)

    def packed(self, coordinates: Array) -> Array:
        """The retained ones of coordinates (q, m) as the kernels hold them: cosine and sine waves, (1, M)."""
        return (self._turn @ coordinates)[self._kept][None]

    def unpacked(self, kept: Array) -> Array:
        """Coordinates (q, m) from those of the kernels; 0 where a mode is not retained."""
        rows = np.zeros(self._kept.shape)
        rows[self._kept] = kept[0]
        return self._turn.T @ rows

    def motion(self, coordinates: Array) -> Array:
        """Relative displacement (..., q, r) of the pairs of faces, m."""
        return self._in_time((self.waves.relative @ self._in_waves(coordinates)[..., None])[..., 0])

    def modal_force(self, force: Array) -> Array:
        """Modal forces (q, m) of contact forces (q, r) on the right nodes."""
        adjoint = self.waves.relative.conj().transpose(0, 2, 1)
        return self._in_time((adjoint @ self._in_waves(force)[..., None])[..., 0])

    def system(self, omega: float, steps: int) -> RingSystem:
        """Arrays of the kernels at `omega` (rad/s) with `steps` a period: the ring is one structure."""
        ring, kept, q = self.modes.ring, self._kept, self.n_blades
        frequency, damping = self.angular_frequency[self._wave], self.damping[self._wave]
        position, rate = propagation(frequency[kept], damping[kept], 2.0 * np.pi / omega / steps)
        flexibility = self.modes.flexibility(self.angular_frequency)
        at_end = np.zeros(kept.shape)
        at_end[kept] = position[3]
        at_end = at_end[self._cosine] + flexibility
        relative, adjoint = self.waves.relative, self.waves.relative.conj().transpose(0, 2, 1)
        own = self._block_circulant((relative * at_end[:, None]) @ adjoint)
        right = self._rows(relative.transpose(0, 2, 1)).reshape(np.count_nonzero(kept), -1)
        coordinates, linear = ring.free_response(omega), ring.excited
        turns = np.exp(1j * ring.phase * np.multiply.outer(np.asarray(linear.harmonics), np.arange(q)))
        free = turns[:, :, None] * np.einsum("hrm,hm->hr", linear.relative, coordinates)[:, None]
        free_output = turns * linear.output(ring.output, coordinates)[:, None]
        forces = self._block_circulant((self.output * flexibility)[:, None] @ adjoint)
        nothing = np.zeros((1, 1))
        return RingSystem(
            position=position,
            rate=rate,
            right=np.ascontiguousarray(right.T),
            left=nothing,
            right_modes=np.ascontiguousarray(right),
            left_modes=nothing,
            own=own,
            previous=nothing,
            following=nothing,
            free_motion=cosine_rows(free.reshape(len(free), -1)),
            free_output=cosine_rows(free_output),
            output_modes=np.ascontiguousarray(self._rows(self.output[..., None])[..., 0].T),
            output_forces=np.stack([forces, np.zeros_like(forces)]),
            waves=np.array([[1.0, 0.0]]),
            contact=node_law(ring.contact, q),
        )

    @cached_property
    def _wave(self) -> NDArray[np.int64]:
        """Waves l of the real waves, (q,): 0, then cosine and sine of 1, of 2, ..., and q / 2."""
        return (np.arange(self.n_blades) + 1) // 2

    @cached_property
    def _cosine(self) -> NDArray[np.int64]:
        """Place (J,) of the cosine of each wave among the real waves."""
        return np.maximum(2 * np.arange(len(self.phases)) - 1, 0)

    @cached_property
    def _turn(self) -> Array:
        """Real discrete Fourier transform, orthogonal, (q, q): real waves from values of the sectors."""
        turn = self._complex_turn
        return np.where(self._is_cosine[:, None], turn.real, turn.imag)

    @cached_property
    def _is_cosine(self) -> NDArray[np.bool_]:
        """Whether a real wave is a cosine, (q,); those of 0 and q / 2 are."""
        return self._cosine[self._wave] == np.arange(self.n_blades)

    @cached_property
    def _complex_turn(self) -> ComplexArray:
        """Values (q, q) of the sectors for the wave of each real wave.

        With z = (a - i b) / 2^(1/2) the waves l and q - l together have the real part of these for a, the imaginary
        part for b.
        """
        angle = np.multiply.outer(self.phases[self._wave], np.arange(self.n_blades))
        alone = 2 * self._wave % self.n_blades == 0
        return np.exp(1j * angle) * np.sqrt(np.where(alone, 1.0, 2.0) / self.n_blades)[:, None]

    @cached_property
    def _kept(self) -> NDArray[np.bool_]:
        """Modes of the real waves that are integrated, (q, m)."""
        return self.retained[self._wave]

    def _rows(self, values: NDArray[Any]) -> Array:
        """Values (M, q, a) of the retained modes of the real waves on the sectors, from (J, m, a) of the waves."""
        row, mode = np.nonzero(self._kept)
        turned = self._complex_turn[row][:, :, None] * values[self._wave[row], mode][:, None]
        return np.where(self._is_cosine[row][:, None, None], turned.real, turned.imag)

    def _block_circulant(self, values: ComplexArray) -> Array:
        """Real matrix (q a, q b) of the sectors, of matrices (J, a, b) of the waves."""
        q, (_, a, b) = self.n_blades, values.shape
        blocks = np.fft.irfft(values, n=q, axis=0)
        offset = np.subtract.outer(np.arange(q), np.arange(q)) % q
        return np.ascontiguousarray(blocks[offset].transpose(0, 2, 1, 3).reshape(q * a, q * b))

    def _in_waves(self, values: Array) -> ComplexArray:
        """z (..., J, m) of the waves from values (..., q, m) of the sectors."""
        return np.fft.rfft(values, axis=-2, norm="ortho")

    def _in_time(self, values: ComplexArray) -> Array:
        """Values (..., q, m) of the sectors from those of the waves."""
        return np.fft.irfft(values, n=self.n_blades, axis=-2, norm="ortho")
