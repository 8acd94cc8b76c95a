"""The structure as perturbations of all nodal diameters see it, in few contact motions that all waves share.

A sector with a disk has modes of its own in each wave. Without a disk, with the motions R and L of the right and left
face of a blade and the flexibilities F of its modes, a wave with the phase alpha from blade to blade has the
flexibility of contacts

    (R - e^(i alpha) L) F (R - e^(i alpha) L)^H = R F R^T + L F L^T - e^(i alpha) L F R^T - e^(-i alpha) R F L^T.

The first two terms, the local flexibility of both faces, are the mean of all waves. The others are small for the
higher modes: what moves one face there hardly moves the other.
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.stability.closed_refinement import ClosedContact, ClosedRefinement, PerturbationStructure
from nonlinear.stability.hill import HillProblem
from nonlinear.stability.modal_condensation import Matrix, poles_and_residues
from nonlinear.stability.perturbation_pencils import (
    TERMS,
    PerturbationPencils,
    SharedMotions,
    WeightedModes,
    unweighted,
)
from nonlinear.stability.point_contact import PointContact
from nonlinear.stability.reduced_problem import contact_weights
from rom.cyclic.cyclic_symmetry import relative_contact_motion
from rom.cyclic.modal_model import ModalModel, WaveModes
from rom.cyclic.sector_modes import RingModes

NEGLIGIBLE_WAVE_MOTION = 0.1  # singular value of phi_m / omega_m times the square root of the contact stiffness
NEGLIGIBLE_DEVIATION = 0.03  # of a wave's flexibility from the mean of all waves, times the contact stiffness
ABOVE = 10.0  # frequency of modes that fill a row, as a multiple of the highest one


@dataclass(frozen=True)
class WaveFlexibility(SharedMotions):
    """Contact motion under contact forces, B_n (s^2 + s C + K)^-1 B_n^H, of the waves n = 0 .. N_b - 1."""

    # `stiffness`, `damping`: (N_b, q), of the lowest modes of each wave
    stiffness: Matrix
    damping: Matrix
    motion: ComplexArray  # (N_b, p, q), their contact motions, in y
    adjoint: ComplexArray  # (N_b, q, p), what they take of contact forces
    inertia: float  # 1; 0 with Coriolis forces, of poles in place of modes
    # (N_b, 4, p, p), terms of the flexibility in y of the other modes of each wave, less the mean
    deviation: ComplexArray

    @classmethod
    def of(cls, modal: RingModes, contact: ContactParameters, highest: float) -> "WaveFlexibility":
        """All waves of a ring."""
        weight, n_blades = contact_weights(contact), modal.n_blades
        assert n_blades is not None
        last = n_blades // 2
        waves = [_Wave.of(modal.at(n), 2.0 * np.pi * n / n_blades, weight, highest) for n in range(last + 1)]
        shares = np.array([1.0 if 2 * n % n_blades == 0 else 2.0 for n in range(last + 1)]) / n_blades
        mean, vectors = _shared_motions(waves, shares)
        lowest = max(wave.low.frequency.size for wave in waves)
        kind = np.result_type(*(part for wave in waves for part in (wave.low.stiffness, wave.low.damping)))
        stiffness = np.full((n_blades, lowest), (ABOVE * highest) ** 2, dtype=kind)
        damping = np.full((n_blades, lowest), ABOVE * highest, dtype=kind)
        adjoint = np.zeros((n_blades, lowest, vectors.shape[1]), dtype=complex)
        motion = np.zeros((n_blades, vectors.shape[1], lowest), dtype=complex)
        deviation = np.empty((n_blades, TERMS, vectors.shape[1], vectors.shape[1]), dtype=complex)
        common = vectors.T @ mean @ vectors
        for n, wave in enumerate(waves):
            low, count = wave.low, wave.low.frequency.size
            low, others = low.in_motions(vectors), wave.high.in_motions(vectors).terms() - common
            own = low.stiffness, low.damping, low.motion, low.adjoint, others
            for place in {n, -n % n_blades}:
                parts = own if place == n else tuple(part.conj() for part in own)
                stiffness[place, :count], damping[place, :count], motion[place, :, :count] = parts[:3]
                adjoint[place, :count], deviation[place] = parts[3:]
        shared = unweighted(mean, vectors, weight)
        return cls(*shared, stiffness, damping, motion, adjoint, waves[0].low.inertia, deviation)

    @cached_property
    def poles(self) -> tuple[ComplexArray, ComplexArray]:
        """Poles and residues of the lowest modes of each wave, (N_b, 2, q)."""
        return poles_and_residues(self.stiffness, self.damping, np.ones(len(self.damping)), self.inertia)

    @cached_property
    def stiffening(self) -> Array:
        """What contact springs add at most to the squares of the natural frequencies, (N_b, q) (rad/s)^2."""
        found = np.asarray(np.sum(np.abs(self.motion) ** 2, axis=1))
        return found if self.inertia else 2.0 * found  # each pole has half of the square of a mode

    @cached_property
    def rise(self) -> Array:
        """How far contact springs raise the natural frequencies at most, (N_b, q) rad/s."""
        squared = np.abs(self.stiffness)
        return np.asarray(np.sqrt(squared + self.stiffening) - np.sqrt(squared))

    def pencils(self, phases: Array, harmonics: Array) -> PerturbationPencils:
        """The eigenvalue problems of several perturbations, each of a nodal diameter.

        Shapes: `phases` (K, S), `harmonics` (S,).
        """
        n_blades = len(self.damping)
        number = np.rint(phases * n_blades / (2.0 * np.pi)).astype(np.int64) % n_blades
        poles, residues = (part[number] for part in self.poles)
        return PerturbationPencils(
            harmonics,
            poles,
            residues,
            self.motion[number],
            self.adjoint[number],
            self.rise[number][:, :, None],
            self.stiffening[number][:, :, None],
            self.deviation[number],
        )


class _Wave(NamedTuple):
    """The lowest modes of a wave, and the others."""

    low: WeightedModes
    high: WeightedModes

    @classmethod
    def of(cls, own: ModalModel, phase: float, weight: Array, highest: float) -> "_Wave":
        every = WeightedModes.of(own, weight[:, None] * relative_contact_motion(own.right, own.left, phase))
        frequency = every.frequency
        low = (frequency > 0.0) & (frequency <= highest)  # rigid motions of a disk do not move the contacts
        return cls(every.chosen(low), every.chosen(frequency > highest))


def _shared_motions(waves: list[_Wave], shares: Array) -> tuple[Array, Array]:
    """The mean terms of the higher modes (4, n, n), and U (n, p)."""
    size = len(waves[0].low.motion)
    mean, squared = np.zeros((TERMS, size, size)), np.zeros((size, size))
    scale = (NEGLIGIBLE_WAVE_MOTION / NEGLIGIBLE_DEVIATION) ** 2 / shares.min()
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
    return mean, vectors[:, sizes > NEGLIGIBLE_WAVE_MOTION**2]


NEGLIGIBLE_FACE_MOTION = 0.02  # singular value of phi_m / omega_m times the square root of the contact stiffness
NEGLIGIBLE_ACROSS = 0.005  # of the flexibility from one face to the other, times the contact stiffness


@dataclass(frozen=True)
class FaceFlexibility(SharedMotions):
    """Contact motion under contact forces in any wave of a ring of blades."""

    # `angular_frequency`, `damping`: (q,), of the lowest modes
    angular_frequency: Array
    damping: Array
    # `right`, `left`: (p, q), motions of the faces by these modes, in y
    right: Array
    left: Array
    stiffening: Array  # (q,), what contact springs add at most to the squares of the natural frequencies, (rad/s)^2
    across: Array  # (4, p, p), terms of R F L^T of the other modes, in y

    @classmethod
    def of(cls, modal: ModalModel, contact: ContactParameters, highest: float) -> "FaceFlexibility":
        """The flexibility of a blade."""
        assert modal.left is not None
        weight, frequency = contact_weights(contact), modal.angular_frequency
        low = frequency <= highest
        faces = [weight[:, None] * face for face in (modal.right, modal.left)]
        (low_r, high_r), (low_l, high_l) = (
            [WeightedModes.of(modal, face).chosen(some) for some in (low, ~low)] for face in faces
        )
        static = np.concatenate([low_r.motion, low_l.motion], axis=1) / np.tile(low_r.frequency, 2)
        across = high_r.term(0, high_l)
        scale = (NEGLIGIBLE_FACE_MOTION / NEGLIGIBLE_ACROSS) ** 2
        squared = static @ static.T + scale * (across @ across.T + across.T @ across)
        sizes, vectors = np.linalg.eigh(squared)
        vectors = vectors[:, sizes > NEGLIGIBLE_FACE_MOTION**2]
        return cls(
            *unweighted(high_r.terms() + high_l.terms(), vectors, weight),
            low_r.frequency,
            low_r.damping,
            vectors.T @ low_r.motion,
            vectors.T @ low_l.motion,
            np.sum((np.abs(low_r.motion) + np.abs(low_l.motion)) ** 2, axis=0),
            high_r.in_motions(vectors).terms(high_l.in_motions(vectors)),
        )

    @cached_property
    def rise(self) -> Array:
        """How far contacts raise the natural frequencies at most, (q,) rad/s."""
        return np.asarray(np.sqrt(self.angular_frequency**2 + self.stiffening) - self.angular_frequency)

    def pencils(self, phases: Array, harmonics: Array) -> PerturbationPencils:
        """The eigenvalue problems of several perturbations.

        Shapes: `phases` (K, S), `harmonics` (S,).
        """
        ahead = np.exp(1j * phases)[:, :, None, None]
        shape = *phases.shape, 1, 1
        poles, residues = (
            np.broadcast_to(part, (len(phases), *part.shape))
            for part in poles_and_residues(self.angular_frequency**2, self.damping, harmonics)
        )
        across, motion = self.across, self.right - ahead * self.left
        return PerturbationPencils(
            harmonics,
            poles,
            residues,
            motion,
            motion.conj().transpose(0, 1, 3, 2),
            np.broadcast_to(self.rise, (*shape[:3], self.rise.size)),
            np.broadcast_to(self.stiffening, (*shape[:3], self.rise.size)),
            -ahead[..., None] * across.transpose(0, 2, 1) - ahead.conj()[..., None] * across,
        )


HIGHEST = 1.5  # of the lowest modes, over the highest frequency of a perturbation
RATIO = 1.25  # from one such frequency to the next
KEPT = 16  # nodal diameters whose modes are kept


@dataclass(frozen=True)
class RingStructure:
    """The structure in the perturbations of a wave."""

    problem: HillProblem  # perturbations of the wave, kappa = 0
    contact: ContactParameters  # parameters of the contact nodes
    n_blades: int  # n_b
    _motions: dict[int, WaveFlexibility | FaceFlexibility] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )
    _modes: dict[int, WaveModes] = field(default_factory=dict, init=False, repr=False, compare=False)

    @cached_property
    def harmonics(self) -> Array:
        """0, 1, -1, 2, -2, ...; (S,)."""
        return self.problem.harmonics

    def motions(self, omega: float) -> WaveFlexibility | FaceFlexibility:
        """The flexibility of the waves, with lowest modes that suffice."""
        highest = HIGHEST * (self.problem.n_harmonics + 0.5) * omega
        number = int(np.ceil(np.log(highest) / np.log(RATIO)))
        if number not in self._motions:
            modal, frequency = self.problem.modal, RATIO**number
            self._motions[number] = (
                WaveFlexibility.of(modal, self.contact, frequency)
                if modal.waves_differ
                else FaceFlexibility.of(modal.at(0), self.contact, frequency)
            )
        return self._motions[number]

    def closed(self, contact: PointContact) -> ClosedContact:
        """The contact of a point closed around the mean flexibility; the same object if it is asked for again."""
        motions, known = self.motions(contact.omega), contact.in_few_modes
        if id(motions) not in known:
            known[id(motions)] = ClosedContact.of(self.problem, motions, contact)
        closed = known[id(motions)]
        assert isinstance(closed, ClosedContact)
        return closed

    def pencils(self, diameters: NDArray[np.int64], omega: float) -> PerturbationPencils:
        """The eigenvalue problems of some nodal diameters.

        Shapes: `diameters` (K,).
        """
        return self.motions(omega).pencils(self.phases(2.0 * np.pi * diameters / self.n_blades), self.harmonics)

    def phases(self, kappas: Array) -> Array:
        """Phase from blade to blade in each harmonic of some perturbations, (K, S) rad.

        Shapes: `kappas` (K,).
        """
        return np.asarray(self.harmonics * self.problem.phase + kappas[:, None])

    def refinement(self, contact: PointContact, k: int) -> ClosedRefinement:
        """What refines the eigenvalues of a nodal diameter."""
        omega = contact.omega
        if k not in self._modes:
            if len(self._modes) >= KEPT:
                self._modes.clear()
            phases, modal = self.phases(np.array([2.0 * np.pi * k / self.n_blades]))[0], self.problem.modal
            self._modes[k] = modal.in_motion(modal.waves(phases), phases, [True] * phases.size)
        structure = PerturbationStructure(self.motions(omega), self.pencils(np.array([k]), omega), self._modes[k])
        real = 2 * k % self.n_blades == 0
        return ClosedRefinement(structure, contact, self.closed(contact), real)
