"""Contact motions and flexibility of a sector with a disk in all waves, in a few contact motions that they share."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.stability.modal_condensation import poles_and_residues
from nonlinear.stability.perturbation_pencils import PerturbationPencils
from nonlinear.stability.shared_motions import TERMS, SharedMotions, WeightedModes, contact_weights, unweighted
from rom import SectorModes, relative_contact_motion

NEGLIGIBLE_MOTION = 0.1  # singular value of phi_m / omega_m times the square root of the contact stiffness
NEGLIGIBLE_DEVIATION = 0.03  # of a wave's flexibility from the mean of all waves, times the contact stiffness
ABOVE = 10.0  # frequency of modes that fill a row, as a multiple of the highest one


@dataclass(frozen=True)
class WaveFlexibility(SharedMotions):
    """Contact motion under contact forces, B_n (s^2 + s C + K)^-1 B_n^H, of the waves n = 0 .. N_b - 1."""

    angular_frequency: Array  # (N_b, q), of the lowest modes of each wave
    damping: Array  # (N_b, q), of the lowest modes of each wave
    motion: ComplexArray  # (N_b, p, q), their contact motions, in y
    # (N_b, 4, p, p), terms of the flexibility in y of the other modes of each wave, less the mean
    deviation: ComplexArray

    @classmethod
    def of(cls, modal: SectorModes, contact: ContactParameters, highest: float) -> "WaveFlexibility":
        """All waves of a ring."""
        weight = contact_weights(contact)
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
        return cls(*unweighted(mean, vectors, weight), frequency, damping, motion, deviation)

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

    def pencils(self, number: NDArray[np.int64], harmonics: Array) -> PerturbationPencils:
        """The eigenvalue problems of several perturbations.

        Shapes: `number` (K, S), `harmonics` (S,).
        """
        backward = (harmonics < 0.0)[:, None, None]
        poles, residues = (part[number] for part in self.poles)
        rise = self.stiffened - self.angular_frequency
        return PerturbationPencils(
            harmonics,
            np.where(backward, poles.conj(), poles),
            np.where(backward, residues.conj(), residues),
            self.motion[number],
            rise[number][:, :, None],
            self.stiffening[number][:, :, None],
            self.deviation[number],
        )


class _Wave(NamedTuple):
    """The lowest modes of a wave, and the others."""

    low: WeightedModes
    high: WeightedModes

    @classmethod
    def of(cls, modal: SectorModes, n: int, weight: Array, highest: float) -> "_Wave":
        own = modal.at(n)
        motion = weight[:, None] * relative_contact_motion(own.right, own.left, 2.0 * np.pi * n / modal.n_blades)
        frequency = own.angular_frequency
        low = (frequency > 0.0) & (frequency <= highest)  # rigid motions of a disk do not move the contacts
        parts = (
            WeightedModes(frequency[some], own.damping[some], motion[:, some]) for some in (low, frequency > highest)
        )
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
