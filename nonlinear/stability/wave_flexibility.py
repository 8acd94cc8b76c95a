"""Contact motions and flexibility of a sector with a disk in all waves, in a few contact motions that they share.

The lowest modes of each wave stay what they are. All others are a flexibility without resonance, a series in s:

    1 / (s^2 + c_m s + omega_m^2) = 1 / omega_m^2 - (s^2 + c_m s) / omega_m^4 + s^4 / omega_m^6 - ...

Most of it, the local flexibility of the contact faces, is the same in all waves. The contact motions of the lowest
modes, and what the flexibility of a wave differs by from the mean of all waves, span few dimensions.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.stability.block_matrices import HarmonicBlocks, Matrix
from nonlinear.stability.modal_condensation import CondensedModes, poles_and_residues
from rom import SectorModes, relative_contact_motion

NEGLIGIBLE_MOTION = 0.1  # singular value of phi_m / omega_m times the square root of the contact stiffness
NEGLIGIBLE_DEVIATION = 0.03  # of a wave's flexibility from the mean of all waves, times the contact stiffness
ABOVE = 10.0  # frequency of modes that fill a row, as a multiple of the highest one
TERMS = 4  # of the series: 1, -s^2, -s, s^4


@dataclass(frozen=True)
class WaveFlexibility:
    """Contact motion under contact forces, B_n (s^2 + s C + K)^-1 B_n^H, of the waves n = 0 .. N_b - 1.

    Contact displacements times the square root of the contact stiffness have the p shared motions U, orthonormal
    columns: d = W^-1 U y.

    Attributes
    ----------
    shared : (3 n_c, p)
        W^-1 U.
    mean : (4, 3 n_c, 3 n_c)
        Terms of the flexibility of the modes above the lowest ones, mean of all waves.
    angular_frequency, damping : (N_b, q)
        Of the lowest modes of each wave.
    motion : (N_b, p, q)
        Their contact motions, in y.
    deviation : (N_b, 4, p, p)
        Terms of the flexibility in y of the other modes of each wave, less the mean.
    """

    shared: Array
    mean: Array
    angular_frequency: Array
    damping: Array
    motion: ComplexArray
    deviation: ComplexArray

    @classmethod
    def of(cls, modal: SectorModes, contact: ContactParameters, highest: float) -> "WaveFlexibility":
        """All waves of a ring.

        Parameters
        ----------
        modal : rom.SectorModes
            The modes.
        contact : ContactParameters
            The contact stiffnesses.
        highest : float
            Largest natural frequency of the lowest modes, rad/s.
        """
        kt, kn = contact.tangential_stiffness, contact.normal_stiffness
        weight = np.sqrt(np.stack([kt, kt, kn], axis=1).ravel())
        last = modal.n_blades // 2
        waves = [_Wave.of(modal, n, weight, highest) for n in range(last + 1)]
        shares = np.array([1.0 if 2 * n % modal.n_blades == 0 else 2.0 for n in range(last + 1)]) / modal.n_blades
        mean, vectors = _shared_motions(waves, shares)
        lowest = max(wave.low.frequency.size for wave in waves)
        frequency, damping = np.full((2, modal.n_blades, lowest), ABOVE * highest)
        motion = np.zeros((modal.n_blades, vectors.shape[1], lowest), dtype=complex)
        deviation = np.empty((modal.n_blades, TERMS, vectors.shape[1], vectors.shape[1]), dtype=complex)
        common = vectors.T @ mean @ vectors
        for n, wave in enumerate(waves):
            low, count = wave.low, wave.low.frequency.size
            for place, conjugate in {n: False, -n % modal.n_blades: True}.items():
                frequency[place, :count], damping[place, :count] = low.frequency, low.damping
                own, rest = vectors.T @ low.motion, wave.high.in_motions(vectors).terms() - common
                motion[place, :, :count] = own.conj() if conjugate and n != place else own
                deviation[place] = rest.conj() if conjugate and n != place else rest
        inverse = np.divide(1.0, weight, out=np.zeros_like(weight), where=weight > 0.0)
        mean *= inverse[:, None] * inverse
        return cls(inverse[:, None] * vectors, mean, frequency, damping, motion, deviation)

    @cached_property
    def poles(self) -> tuple[ComplexArray, ComplexArray]:
        """Poles and residues of the lowest modes in harmonics h >= 0, (N_b, 2, q); the conjugates in others."""
        return poles_and_residues(self.angular_frequency, self.damping, np.ones(len(self.damping)))

    @cached_property
    def stiffening(self) -> Array:
        """What contact springs add at most to the squares of the natural frequencies, (N_b, q) (rad/s)^2."""
        return np.asarray(np.sum(np.abs(self.motion) ** 2, axis=1))

    @cached_property
    def stiffened(self) -> Array:
        """The highest that contact springs can raise the natural frequencies to, (N_b, q) rad/s."""
        return np.asarray(np.sqrt(self.angular_frequency**2 + self.stiffening))

    def structure(self, active: NDArray[np.bool_], s: ComplexArray, omega: float, static: bool) -> CondensedModes:
        """The mean flexibility of the waves, with y as outputs and the forces on these as inputs; no states.

        Parameters
        ----------
        active : (3 n_c,) bool
            The contact dofs that appear in d and f.
        s : (S,)
            lambda + i h omega of the harmonics, 1/s.
        omega : float
            Excitation frequency, rad/s.
        static : bool
            Whether the first of the harmonics is 0.
        """
        values, derivatives = series(self.mean[:, active][:, :, active], s, omega)
        shared = np.kron(np.eye(s.size), self.shared[active])
        first = int(static)
        none = np.zeros((0, 0), dtype=complex)
        blocks, changes = (
            HarmonicBlocks(part[0] if static else none, part[first:]) for part in (values, derivatives)
        )
        return CondensedModes(np.zeros((shared.shape[1],) * 2), shared.T, shared, blocks, changes)


def series(terms: Matrix, s: ComplexArray, omega: float) -> tuple[ComplexArray, ComplexArray]:
    """A flexibility from the `terms` of its series, (..., 4, n, n), and its derivative in sigma = s / omega.

    Parameters
    ----------
    terms : (4, n, n) or (..., S, 4, n, n)
        Factors of 1, -s^2, -s and s^4, of all harmonics or of each.
    s : (S,) or (..., S)
        Of the harmonics, 1/s.
    omega : float
        Excitation frequency, rad/s.

    Returns
    -------
    (..., S, n, n) twice
        The flexibility and its derivative.
    """
    powers = np.stack([np.ones_like(s), -(s**2), -s, s**4], axis=-1)
    changes = omega * np.stack([np.zeros_like(s), -2.0 * s, -np.ones_like(s), 4.0 * s**3], axis=-1)
    flat = terms.reshape(*terms.shape[:-2], -1)
    shape = (*(terms.shape[:-3] or s.shape), *terms.shape[-2:])
    value, change = ((factors[..., None, :] @ flat).reshape(shape) for factors in (powers, changes))
    return value, change


class _Modes(NamedTuple):
    """Frequency and damping (m,) and weighted contact motion (n, m) of some modes of a wave."""

    frequency: Array
    damping: Array
    motion: Matrix

    def in_motions(self, vectors: Array) -> "_Modes":
        return self._replace(motion=vectors.T @ self.motion)

    def term(self, number: int) -> Matrix:
        """A factor of the series (`series`), (n, n)."""
        squared = self.frequency**2
        factor = (1.0 / squared, 1.0 / squared**2, self.damping / squared**2, 1.0 / squared**3)[number]
        return np.asarray((self.motion * factor) @ self.motion.conj().T)

    def terms(self) -> Matrix:
        """All factors, (4, n, n)."""
        return np.stack([self.term(number) for number in range(TERMS)])


class _Wave(NamedTuple):
    """The lowest modes of a wave, and the others."""

    low: _Modes
    high: _Modes

    @classmethod
    def of(cls, modal: SectorModes, n: int, weight: Array, highest: float) -> "_Wave":
        own = modal.at(n)
        motion = weight[:, None] * relative_contact_motion(own.right, own.left, 2.0 * np.pi * n / modal.n_blades)
        frequency = own.angular_frequency
        low = (frequency > 0.0) & (frequency <= highest)  # rigid motions of a disk do not move the contacts
        parts = (_Modes(frequency[some], own.damping[some], motion[:, some]) for some in (low, frequency > highest))
        return cls(*parts)


def _shared_motions(waves: list[_Wave], shares: Array) -> tuple[Array, Array]:
    """The mean terms of the higher modes (4, n, n), and U (n, p)."""
    size = len(waves[0].low.motion)
    mean, squared = np.zeros((TERMS, size, size)), np.zeros((size, size))
    scale = (NEGLIGIBLE_MOTION / NEGLIGIBLE_DEVIATION) ** 2 / shares.min()
    for wave, share in zip(waves, shares, strict=True):
        first = wave.high.term(0)
        squared += scale * share * (first @ first).real
        static = wave.low.motion / wave.low.frequency
        squared += share / shares.min() * (static @ static.conj().T).real
        mean[0] += share * first.real
        for number in range(1, TERMS):
            mean[number] += share * wave.high.term(number).real
    squared -= scale * mean[0] @ mean[0]
    sizes, vectors = np.linalg.eigh(squared)
    return mean, vectors[:, sizes > NEGLIGIBLE_MOTION**2]
