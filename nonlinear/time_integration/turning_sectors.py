"""Sectors with Coriolis forces in time: the poles of each wave move each by itself.

With Coriolis forces the modes of a wave couple. Its poles s with the shapes x and the left vectors l,

    l (s^2 + s D + K) = 0,    p = l ((s + D) z + z'),    p' = s p + l f,    z = sum x p,    z' = sum s x p,

do not: they advance exactly over a step for a force that varies linearly over it. Poles up to the retention are
integrated, the others follow their forces at once, p = -l f / s: what Coriolis forces of low modes do to high ones is
not lost. Rigid motions are softly held.

The wave of +l holds the poles that turn forward and backward. In a real wave, 0 or q / 2, poles come in pairs p and
conj p: the kernels hold real and imaginary part, p = (a - i b) / 2^(1/2), as they hold cosine and sine of a wave.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.time_integration.ring import RetainedModes
from nonlinear.time_integration.ring_structure import (
    ClampedBlades,
    JoinedSectors,
    RingStructure,
    WavesOverStep,
)
from rom import ModalModel

REAL = 1e-9  # imaginary part over the size of a pole that is none


def pole_propagation(poles: ComplexArray, step: float) -> ComplexArray:
    """Coefficients of p' = s p + f over one step, f linear from f_0 to f_1: of p, of nothing, of f_0 and of f_1.

    Shapes: `poles` (...), returns (4, ...).
    """
    from scipy.linalg import expm

    generator = np.zeros((poles.size, 3, 3), complex)  # of p, h f, h^2 df/dt in t / h
    generator[:, 0, 0], generator[:, 0, 1], generator[:, 1, 2] = step * poles.ravel(), 1.0, 1.0
    after = expm(generator)[:, 0]
    found = np.stack([after[:, 0], np.zeros(poles.size), step * (after[:, 1] - after[:, 2]), step * after[:, 2]])
    return found.reshape(4, *poles.shape)


@dataclass(frozen=True)
class WavePoles:
    """The 2 m poles of a wave, rows and columns filled up with zeros to the modes of the wave with the most."""

    values: ComplexArray  # (n,), s, rad/s
    shapes: ComplexArray  # (m, n), x
    of_rates: ComplexArray  # (n, m), l
    damping: ComplexArray  # (m, m), D
    chosen: tuple[NDArray[np.int64], ...]  # those that are integrated; of a real wave one of each pair, and real ones
    follows: Array  # (n,), 1 for those that are not

    @classmethod
    def of(cls, modal: ModalModel, size: int, modes: RetainedModes, is_real: bool) -> "WavePoles":
        """Those of a wave."""
        found, own = modal.turning, modal.angular_frequency.size
        values, retained = found.poles, modes.are_retained(np.abs(found.poles))
        shapes, of_rates = np.zeros((size, values.size), complex), np.zeros((values.size, size), complex)
        shapes[:own], of_rates[:, :own] = found.shapes, -found.dual / values.conj()[:, None]
        damping = np.zeros((size, size), complex)
        damping[:own, :own] = np.diag(modal.total_damping) + modal.coriolis
        chosen: tuple[NDArray[np.int64], ...] = (np.flatnonzero(retained),)
        if is_real:
            alone = np.abs(values.imag) <= REAL * np.abs(values)
            largest = shapes[np.abs(shapes).argmax(axis=0), np.arange(values.size)]
            turn = np.where(alone, largest / np.abs(largest), 1.0)  # real shapes of real poles
            shapes, of_rates = shapes / turn, of_rates * turn[:, None]
            chosen = np.flatnonzero(retained & ~alone & (values.imag > 0.0)), np.flatnonzero(retained & alone)
        return cls(values, shapes, of_rates, damping, chosen, np.where(retained, 0.0, 1.0))

    @property
    def half(self) -> int:
        """Half of the number of slots that they take in the kernels."""
        if len(self.chosen) == 1:
            return -(-self.chosen[0].size // 2)
        return int(self.chosen[0].size + -(-self.chosen[1].size // 2))

    def slots(self, columns: ComplexArray, half: int, sign: float) -> ComplexArray:
        """Columns (..., n) of the poles as those of the slots (..., 2 half).

        `sign`: 1 for what the poles make, -1 for what makes them, 0 for coefficients of a step.
        """
        found = np.zeros((*columns.shape[:-1], 2 * half), complex)
        if len(self.chosen) == 1:
            found[..., : self.chosen[0].size] = columns[..., self.chosen[0]]
            return found
        pairs, alone = (columns[..., each] for each in self.chosen)
        count, places = pairs.shape[-1], np.arange(alone.shape[-1])
        scale = np.sqrt(2.0)
        found[..., :count] = pairs if sign == 0.0 else scale * pairs.real
        found[..., half : half + count] = pairs if sign == 0.0 else sign * scale * pairs.imag
        found[..., count + places // 2 + half * (places % 2)] = alone.real
        return found


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
        """Coordinates (q, m) and rates of the poles."""
        waves = self._complex_waves(kept.reshape(self.n_blades, -1))[..., None]
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
            own, kept = -each.follows / each.values, np.flatnonzero(each.follows == 0.0)
            force = each.of_rates @ taken
            residual_output.append(((output @ each.shapes) * own)[None] @ force)
            coefficients = np.zeros((4, own.size), complex)
            coefficients[:, kept] = pole_propagation(each.values[kept], step)
            own[kept] = coefficients[3, kept]
            at_end.append(((moved @ each.shapes) * own) @ force)
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
        by_pole = [each.slots((each.values[:, None] * each.of_rates).T, self._half, -1.0).T for each in self.poles]
        return np.stack(by_pole) + self._of_rates @ np.stack([each.damping for each in self.poles])

    def _real_waves(self, waves: ComplexArray) -> Array:
        """Real waves (q, k) of z (J, k)."""
        values, alone = waves[self._wave], (2 * self._wave % self.n_blades == 0)[:, None]
        is_cosine = alone | (np.arange(self.n_blades) % 2 == 1)[:, None]
        return np.where(is_cosine, values.real, -values.imag) * np.where(alone, 1.0, np.sqrt(2.0))

    def _complex_waves(self, real: Array) -> ComplexArray:
        """z (J, k) of real waves (q, k)."""
        found = np.zeros((len(self.phases), real.shape[1]), complex)
        pairs = (self.n_blades - 1) // 2
        found[0], found[-1] = real[0], real[-1]
        found[1 : pairs + 1] = (real[1 : 2 * pairs : 2] - 1j * real[2 : 2 * pairs + 1 : 2]) / np.sqrt(2.0)
        return found


def ring_structure(modes: RetainedModes, n_blades: int) -> RingStructure:
    """The structure of q blades."""
    modal = modes.ring.modal
    if modal.turns:
        return TurningSectors(modes, n_blades)
    return (JoinedSectors if modal.waves_differ else ClampedBlades)(modes, n_blades)
