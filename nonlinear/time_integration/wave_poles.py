"""The poles of a wave with Coriolis forces in time, each by itself.

With Coriolis forces the modes of a wave couple. Its poles s with the shapes x and the left vectors l,

    l (s^2 + s D + K) = 0,    p = l ((s + D) z + z'),    p' = s p + l f,    z = sum x p,    z' = sum s x p,

do not: they advance exactly over a step for a force that varies linearly over it. Poles up to the retention are
integrated, the others follow their forces at once, p = -l f / s: what Coriolis forces of low modes do to high ones is
not lost. Rigid motions are softly held.

In a wave whose modes are real poles come in pairs p and conj p. The kernels hold real and imaginary part, half of all
slots apart, p = (a - i b) / 2^(1/2), as they hold cosine and sine of another wave.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.time_integration.ring import RetainedModes
from rom.cyclic.modal_model import ModalModel

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

    def over_step(self, step: float) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Coefficients (4, n) of a step (s), flexibility (n,) at its end: x l times it, and what follows of it."""
        follows, kept = -self.follows / self.values, np.flatnonzero(self.follows == 0.0)
        coefficients, at_end = np.zeros((4, follows.size), complex), follows.copy()
        coefficients[:, kept] = pole_propagation(self.values[kept], step)
        at_end[kept] = coefficients[3, kept]
        return coefficients, at_end, follows

    def of_coordinates(self, half: int) -> ComplexArray:
        """Slots of unit coordinates, (2 half, m)."""
        by_pole = self.slots((self.values[:, None] * self.of_rates).T, half, -1.0).T
        return by_pole + self.slots(self.of_rates.T, half, -1.0).T @ self.damping
