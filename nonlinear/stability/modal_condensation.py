"""The open blade under a growing perturbation: poles that are kept as states, and the flexibility of all others."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.stability.block_matrices import HarmonicBlocks, Matrix
from rom import ModalModel

CRITICAL = 1e-8  # relative distance of w_m^2 from (c_m / 2)^2 up to which the two poles of a mode are drawn apart


@dataclass(frozen=True)
class CondensedModes:
    """Contact motion d under contact forces f: lambda z = L z + B f, d = C z + (G + lambda G') f.

    lambda is in units of w. L (n_z, n_z): poles, B (n_z, n): inlet, C (n, n_z): outlet, G and G' (n, n): flexibility
    and its slope.
    """

    poles: Matrix
    inlet: Matrix
    outlet: Matrix
    flexibility: HarmonicBlocks
    slope: HarmonicBlocks


@dataclass(frozen=True)
class ContactFreeModel:
    """Modes of a blade without contact that move as e^(s t), s = lambda + i h w, in the harmonics h.

    Each mode, 1 / (s^2 + c_m s + w_m^2), has two poles. Of the one that turns with h, those with |s| below
    (|h| + reach) w are kept as states, of the other one those with |s| below (reach - |h|) w: what is left out is
    more than reach w away from lambda = 0, and a contact, which stiffens, moves it farther. It acts by its
    flexibility and the slope of that.

    modal : the modes. harmonics : (n_h,) h; 0, if it is there, comes first. relative : (n_h, 3 n_c, m) B_h phi.
    reach : in units of w. highest : harmonics |h| above this keep the poles within reach w of lambda = 0 only, and
    none of modes above (highest + reach) w: where such a mode is near resonance its flexibility has no slope.
    real : the harmonics 0, 1, 2, ... stand for real motions, in rows (0, Re 1, Im 1, ...).
    """

    modal: ModalModel
    harmonics: Array
    relative: ComplexArray
    reach: float
    highest: int
    real: bool

    @property
    def _first(self) -> int:
        """Row of the first harmonic that turns."""
        return int(self.harmonics[0] == 0.0)

    @cached_property
    def _poles(self) -> tuple[ComplexArray, ComplexArray]:
        """Poles s and their residues, first those that turn with h (or decay slower): (n_h, 2, m) each."""
        half, squared = self.modal.damping / 2.0, self.modal.angular_frequency**2
        under = squared - half**2
        apart = np.where(np.abs(under) < CRITICAL * squared, CRITICAL * squared, under)
        swing = 1j * np.sqrt(apart.astype(complex)).conj()
        poles, residues = np.stack([-half + swing, -half - swing]), np.stack([0.5 / swing, -0.5 / swing])
        backward = (self.harmonics < 0.0)[:, None, None]
        return np.where(backward, poles.conj(), poles), np.where(backward, residues.conj(), residues)

    def _kept(self, omega: float) -> NDArray[np.bool_]:
        """Which poles are states, (n_h, 2, m)."""
        h, size = np.abs(self.harmonics)[:, None], np.abs(self._poles[0]) / omega
        turning = (size[:, 0] <= np.minimum(h, self.highest) + self.reach) & (
            (h <= self.highest) | (size[:, 0] >= h - self.reach)
        )
        kept = np.stack([turning, size[:, 1] <= self.reach - h], axis=1)
        kept[: self._first] = size[: self._first, :1] <= self.reach  # both or none
        return kept

    def condensed(self, omega: float, active: NDArray[np.bool_]) -> CondensedModes:
        """The blade at w = `omega` (rad/s) near lambda = 0, in the contact motions `active` (mask)."""
        kept = self._kept(omega)
        roots = self._poles[0] / omega - 1j * self.harmonics[:, None, None]
        residues = self._poles[1] / omega
        near = np.where(kept, 1.0, -roots)
        rest = np.where(kept, 0.0, residues / near)
        late = np.where(np.abs(near) < self.reach, 0.0, -rest / near)
        relative = np.ascontiguousarray(self.relative[:, active])
        adjoint = relative.conj().transpose(0, 2, 1)
        first = self._first
        row, root, mode = np.nonzero(kept[first:])
        turning = self._turning(
            roots[first:][row, root, mode],
            residues[first:][row, root, mode],
            relative[first:].transpose(0, 2, 1)[row, mode],
            row,
        )
        static = self._static(omega, kept[0, 0], relative[0]) if first else (np.zeros((0, 0)),) * 3
        poles, inlet, outlet = (_diagonal(one, other) for one, other in zip(static, turning, strict=True))
        return CondensedModes(
            poles,
            inlet,
            outlet,
            self._blocks((relative * rest.sum(axis=1)[:, None]) @ adjoint),
            self._blocks((relative * late.sum(axis=1)[:, None]) @ adjoint),
        )

    def _static(self, omega: float, kept: NDArray[np.bool_], relative: Matrix) -> tuple[Matrix, Matrix, Matrix]:
        """L, B, C of harmonic 0: displacement and velocity of each mode kept."""
        modes = np.flatnonzero(kept)
        count, motion = modes.size, (relative.real if self.real else relative)[:, modes]
        poles = np.zeros((2 * count, 2 * count))
        upper, lower = np.arange(count), np.arange(count, 2 * count)
        poles[upper, lower] = 1.0
        poles[lower, upper] = -((self.modal.angular_frequency[modes] / omega) ** 2)
        poles[lower, lower] = -self.modal.damping[modes] / omega
        inlet = np.zeros((2 * count, motion.shape[0]), dtype=motion.dtype)
        inlet[count:] = motion.conj().T / omega**2
        return poles, inlet, np.concatenate([motion, np.zeros_like(motion)], axis=1)

    def _turning(
        self, poles: ComplexArray, residues: ComplexArray, motion: ComplexArray, row: NDArray[np.int64]
    ) -> tuple[Matrix, Matrix, Matrix]:
        """L, B, C of the other harmonics, from pole, residue, motion and harmonic of each state: (k,), (k, n)."""
        count, harmonics, every = poles.size, len(self.harmonics) - self._first, np.arange(poles.size)
        size = harmonics * motion.shape[1]
        inlet = np.zeros((count, harmonics, motion.shape[1]), dtype=complex)
        inlet[every, row] = residues[:, None] * motion.conj()
        outlet = np.zeros((harmonics, motion.shape[1], count), dtype=complex)
        outlet[row, :, every] = motion
        if not self.real:
            return np.diag(poles), inlet.reshape(count, size), outlet.reshape(size, count)
        return (
            _real_form(np.diag(poles)).reshape(2 * count, 2 * count),
            _real_form(inlet.transpose(1, 0, 2)).transpose(1, 2, 0, 3, 4).reshape(2 * count, 2 * size),
            _real_form(outlet).reshape(2 * size, 2 * count),
        )

    def _blocks(self, values: ComplexArray) -> HarmonicBlocks:
        """Block diagonal matrix of the values (n_h, n, n)."""
        count, size, _ = values.shape
        first = self._first
        static = values[0] if first else np.zeros((0, 0), dtype=complex)
        if not self.real:
            return HarmonicBlocks(static, values[first:])
        return HarmonicBlocks(static.real, _real_form(values[first:]).reshape(count - first, 2 * size, 2 * size))


def _real_form(matrix: ComplexArray) -> Array:
    """Maps (..., n, m) of complex amplitudes as maps of their real and imaginary parts, (..., 2, n, 2, m)."""
    *many, rows, columns = matrix.shape
    result = np.empty((*many, 2, rows, 2, columns))
    result[..., 0, :, 0, :] = result[..., 1, :, 1, :] = matrix.real
    result[..., 0, :, 1, :] = -matrix.imag
    result[..., 1, :, 0, :] = matrix.imag
    return result


def _diagonal(one: Matrix, other: Matrix) -> Matrix:
    """Block diagonal matrix of two blocks."""
    rows, columns = one.shape
    result = np.zeros((rows + other.shape[0], columns + other.shape[1]), dtype=np.result_type(one, other))
    result[:rows, :columns], result[rows:, columns:] = one, other
    return result
