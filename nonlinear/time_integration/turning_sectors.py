"""Sectors with Coriolis forces in time: the poles of each wave (`wave_poles`) in place of its modes."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.time_integration.ring_structure import JoinedSectors, WavesOverStep
from nonlinear.time_integration.wave_poles import WavePoles


@dataclass(frozen=True)
class TurningSectors(JoinedSectors):
    """Coordinates (q, m) of q sectors with Coriolis forces; the kernels hold poles, and no rates."""

    @cached_property
    def poles(self) -> tuple[WavePoles, ...]:
        """Those of the J waves."""
        modal, size = self.modes.ring.modal, self.angular_frequency.shape[1]
        is_real = 2 * np.arange(len(self.phases)) % self.n_blades == 0
        return tuple(
            WavePoles.of(modal.at_phase(float(phase)), size, self.modes, bool(real))
            for phase, real in zip(self.phases, is_real, strict=True)
        )

    def packed(self, values: Array) -> Array:
        """Modal forces (q, m) as the kernels hold them, (1, q k)."""
        return self._real_waves((self._of_rates @ self._in_waves(values)[..., None])[..., 0]).reshape(1, -1)

    def packed_state(self, coordinates: Array, rates: Array) -> tuple[Array, Array]:
        """The retained part of coordinates (q, m) and rates: poles, and zeros."""
        position, speed = (self._in_waves(each)[..., None] for each in (coordinates, rates))
        found = self._real_waves((self._of_coordinates @ position + self._of_rates @ speed)[..., 0]).reshape(1, -1)
        return found, np.zeros_like(found)

    def unpacked_state(self, kept: Array, rates: Array) -> tuple[Array, Array]:
        """Coordinates (..., q, m) and rates of the poles."""
        waves = self._complex_waves(kept.reshape(*kept.shape[:-2], self.n_blades, -1))[..., None]
        position, speed = (self._in_time((each @ waves)[..., 0]) for each in (self._shapes, self._speeds))
        return position, speed

    def following(self, force: Array) -> tuple[Array, Array]:
        """Coordinates and rates (q, m) of the poles that follow modal forces (q, m) at once."""
        waves = self._in_waves(force)[..., None]
        taken = self._of_rates @ waves  # the static response of all poles is f / k, the sum of all x l is 0
        position = waves / self._held[..., None] + self._compliances @ taken
        return self._in_time(position[..., 0]), self._in_time((self._shapes @ taken)[..., 0])

    def over_step(self, step: float) -> WavesOverStep:
        """How the waves move over a step, s."""
        relative, adjoint, half = self.waves.relative, self.waves.relative.conj().transpose(0, 2, 1), self._half
        position, at_end, residual_output = [], [], []
        for each, moved, taken, output in zip(self.poles, relative, adjoint, self.output, strict=True):
            coefficients, last, follows = each.over_step(step)
            force = each.of_rates @ taken
            residual_output.append(((output @ each.shapes) * follows)[None] @ force)
            at_end.append(((moved @ each.shapes) * last) @ force)
            position.append(each.slots(coefficients, half, 0.0))
        return WavesOverStep(
            position=np.stack(position, axis=1),
            rate=np.zeros((4, len(position), 2 * half)),
            motion=relative @ self._shapes,
            force=self._of_rates @ adjoint,
            at_end=np.stack(at_end),
            output=self.output[:, None] @ self._shapes,
            residual_output=np.stack(residual_output),
            push=(self._of_rates[0] @ self.push).real,
            half=half,
        )

    @cached_property
    def _half(self) -> int:
        return max(each.half for each in self.poles)

    @cached_property
    def _shapes(self) -> ComplexArray:
        """Coordinates of the slots, (J, m, k)."""
        return np.stack([each.slots(each.shapes, self._half, 1.0) for each in self.poles])

    @cached_property
    def _speeds(self) -> ComplexArray:
        """Rates of the slots, (J, m, k)."""
        return np.stack([each.slots(each.shapes * each.values, self._half, 1.0) for each in self.poles])

    @cached_property
    def _compliances(self) -> ComplexArray:
        """Coordinates of the slots over their poles, (J, m, k)."""
        return np.stack([each.slots(each.shapes / each.values, self._half, 1.0) for each in self.poles])

    @cached_property
    def _held(self) -> NDArray[Any]:
        """Stiffness of the modes, rigid motions softly held, (J, m)."""
        found = np.array(self.stiffness)
        for row, phase in zip(found, self.phases, strict=True):
            own = self.modes.ring.modal.at_phase(float(phase)).held_stiffness
            row[: own.size] = own
        return found

    @cached_property
    def _of_rates(self) -> ComplexArray:
        """Slots of unit rates, and of unit forces, (J, k, m)."""
        return np.stack([each.slots(each.of_rates.T, self._half, -1.0).T for each in self.poles])

    @cached_property
    def _of_coordinates(self) -> ComplexArray:
        """Slots of unit coordinates, (J, k, m)."""
        return np.stack([each.of_coordinates(self._half) for each in self.poles])

    def _real_waves(self, waves: ComplexArray) -> Array:
        """Real waves (q, k) of z (J, k)."""
        values, alone = waves[self._wave], (2 * self._wave % self.n_blades == 0)[:, None]
        is_cosine = alone | (np.arange(self.n_blades) % 2 == 1)[:, None]
        return np.where(is_cosine, values.real, -values.imag) * np.where(alone, 1.0, np.sqrt(2.0))

    def _complex_waves(self, real: Array) -> ComplexArray:
        """z (..., J, k) of real waves (..., q, k)."""
        found = np.zeros((*real.shape[:-2], len(self.phases), real.shape[-1]), complex)
        pairs = (self.n_blades - 1) // 2
        found[..., 0, :], found[..., -1, :] = real[..., 0, :], real[..., -1, :]
        both = real[..., 1 : 2 * pairs + 1, :]
        found[..., 1 : pairs + 1, :] = (both[..., ::2, :] - 1j * both[..., 1::2, :]) / np.sqrt(2.0)
        return found
