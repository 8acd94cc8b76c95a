"""Receptance of the relative contact displacements of a ring of clamped blades with different frequencies.

With the modal coordinates eta_j of blade j, all in the time of their own blade,

    eta_j = (F + R^T f_j - exp(-i h psi) L^T f_(j-1)) / D_j,
    D_j = ((1 + delta_j) omega_m)^2 + i h omega c_m - (h omega)^2,
    d_j = R eta_j - exp(i h psi) L eta_(j+1),

where R and L are the contact motions of the modes, f_j the force on the right face of blade j. So d_j depends on the
forces f_(j-1), f_j and f_(j+1) alone: the receptance of the ring is block-tridiagonal and cyclic.

With Coriolis forces each blade has poles in the place of the modes, but in harmonic 0, where the first half of the
terms are the modes and the others nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.harmonic_balance.residual import counted_at_contacts
from nonlinear.mistuned_ring.cyclic_blocks import CyclicBlockFactors, CyclicBlocks
from nonlinear.mistuned_ring.mistuned_structure import RingStructure, RingSystem, by_pair, from_pairs, real_product
from nonlinear.mistuned_ring.mistuning import Mistuning
from nonlinear.options import Excitation
from nonlinear.time_integration.ring import Ring
from rom.cyclic.modal_model import ModalModel
from rom.cyclic.pole_modes import PoleModes
from rom.cyclic.receptance import RelativeReceptance


class RingBlocks(NamedTuple):
    """Blocks of the receptance: d_j = before[j] f_(j-1) + own[j] f_j + after[j] f_(j+1), (N_b, n_h, 3 n_c, 3 n_c)."""

    before: ComplexArray
    own: ComplexArray
    after: ComplexArray


@dataclass(frozen=True)
class RingFactors:
    """The bordered Jacobian of a ring, in the order of unknowns of the balance."""

    factors: CyclicBlockFactors
    n_rows: int
    weight: Array  # (3 n_c, 3 n_c), of the rows of harmonic 0 in the factors, see `RingReceptance.row_weight`

    @property
    def sign(self) -> int:
        """Sign of the determinant: that of the blocks, which are the unknowns in another order."""
        return self.factors.sign

    def solve(self, right: Array, last: float) -> tuple[Array, float]:
        """Solution (x (n,), z) for the right-hand side (b (n,), b_e); NaN for a singular system."""
        weighted = by_pair(right, self.n_rows, len(self.factors.column))
        weighted[:, : len(self.weight)] @= self.weight
        solution, z = self.factors.solve(weighted, np.array([last]))
        return from_pairs(solution, self.n_rows), float(z[0])


@dataclass(frozen=True)
class RingReceptance(RingStructure):
    """The structure of a ring of clamped blades."""

    tuned: RelativeReceptance  # the tuned blade with its phase psi, harmonics and excitation
    frequency_ratio: Array  # (N_b,), 1 + delta_j

    @property
    def blade(self) -> ModalModel:
        """The modes of the tuned blade alone."""
        return self.tuned.modal.at(0)

    def with_harmonics(self, n_harmonics: int) -> RingReceptance:
        """The same with harmonics 0 to H."""
        return replace(self, tuned=replace(self.tuned, harmonics=tuple(range(n_harmonics + 1))))

    @property
    def n_blades(self) -> int:
        """Number of blades N_b."""
        return self.frequency_ratio.size

    @property
    def n_nodes(self) -> int:
        """Number of contact nodes of a pair."""
        return self.blade.n_contacts

    @cached_property
    def modal_force(self) -> ComplexArray:
        """Modal forces of the excitation, the same of all blades, (n_h, 1, m); of their poles (n_h, N_b, 2 m)."""
        return self._taken(self.tuned.modal_force[:, None, :])

    @cached_property
    def turning(self) -> PoleModes | None:
        """With Coriolis forces the poles of all blades, (N_b, 2 m)."""
        blade = self.blade
        if not blade.turns:
            return None
        found = {}
        for ratio in self.frequency_ratio.tolist():
            if ratio not in found:
                found[ratio] = replace(blade, angular_frequency=ratio * blade.angular_frequency).turning
        every = [found[ratio] for ratio in self.frequency_ratio.tolist()]
        return PoleModes(*(np.array([getattr(each, name) for each in every]) for name in ("poles", "shapes", "dual")))

    def _taken(self, forces: ComplexArray) -> ComplexArray:
        """What the terms take of modal forces (n_h, N_b, m)."""
        if self.turning is None:
            return forces
        found: ComplexArray = (self.turning.dual @ forces[..., None])[..., 0]
        still, size = self._harmonics == 0.0, forces.shape[-1]
        found[still, :, :size], found[still, :, size:] = forces[still], 0.0
        return found

    def _in_modes(self, terms: ComplexArray) -> ComplexArray:
        """Modal coordinates (n_h, N_b, m) of the terms."""
        if self.turning is None:
            return terms
        found: ComplexArray = (self.turning.shapes @ terms[..., None])[..., 0]
        still = self._harmonics == 0.0
        found[still] = terms[still, :, : found.shape[-1]]
        return found

    @cached_property
    def _harmonics(self) -> Array:
        return np.asarray(self.tuned.harmonics, dtype=float)

    @cached_property
    def _ahead(self) -> ComplexArray:
        """exp(i h psi), (n_h, 1, 1)."""
        ahead: ComplexArray = np.exp(1j * self._harmonics * self.tuned.phase)[:, None, None]
        return ahead

    @cached_property
    def _squared(self) -> Array:
        """((1 + delta_j) omega_m)^2, (n_h, N_b, m); bodies that contacts alone hold are the same in all sectors."""
        ratio = np.repeat(self.frequency_ratio[:, None], self.blade.damping.size, axis=1)
        ratio[:, : self.tuned.floating] = 1.0
        squared: Array = (ratio * self.tuned.modes.angular_frequency[:, None, :]) ** 2
        return squared

    def denominators(self, omega: float) -> tuple[ComplexArray, ComplexArray]:
        """D_j, (n_h, N_b, m), and its derivative in omega, (n_h, 1, m); both (n_h, N_b, 2 m) of poles."""
        if self.turning is not None:
            poles = self.turning.poles
            slope = -1j * self._harmonics[:, None, None] * poles.conj()
            whole = np.abs(poles) ** 2 + omega * slope
            still, size = self._harmonics == 0.0, self.blade.damping.size
            whole[still, :, :size] = self._squared[still]
            return whole, slope
        h = self._harmonics[:, None]
        rate = 1j * h * self.blade.damping
        value = (rate * omega - (h * omega) ** 2)[:, None, :] + self._squared
        derivative = (rate - 2.0 * h**2 * omega)[:, None, :]
        return np.asarray(value, dtype=np.complex128), np.asarray(derivative, dtype=np.complex128)

    def pushed(self, force: ComplexArray) -> ComplexArray:
        """Modal forces R^T f_j - exp(-i h psi) L^T f_(j-1), (n_h, N_b, m), of forces (n_h, N_b, 3 n_c)."""
        modal = self.blade
        own: ComplexArray = force @ modal.right
        if modal.left is not None:
            own = own - self._ahead.conj() * (np.roll(force, 1, axis=1) @ modal.left)
        return self._taken(own)

    def relative(self, coordinates: ComplexArray) -> ComplexArray:
        """Relative displacements d_j, (n_h, N_b, 3 n_c), of modal coordinates (n_h, N_b, m)."""
        modal, coordinates = self.blade, self._in_modes(coordinates)
        own: ComplexArray = coordinates @ modal.right.T
        if modal.left is None:
            return own
        return own - self._ahead * np.roll(coordinates @ modal.left.T, -1, axis=1)

    def output(self, name: str, coordinates: ComplexArray) -> ComplexArray:
        """An output of all blades, each in its own time, (N_b, n_h), of modal coordinates (n_h, N_b, m)."""
        found: ComplexArray = (self._in_modes(coordinates) @ self.blade.outputs[name]).T
        return found

    @property
    def floating_motions(self) -> ComplexArray:
        """R - exp(2 pi i l / N_b) L of the bodies that contacts alone hold, (N_b, 3 n_c, r)."""
        modal, some = self.blade, slice(self.tuned.floating)
        left = np.zeros_like(modal.right) if modal.left is None else modal.left
        turns = np.exp(2j * np.pi * np.arange(self.n_blades) / self.n_blades)[:, None, None]
        found: ComplexArray = modal.right[:, some] - turns * left[:, some]
        return found

    def blocks(self, omega: float) -> RingBlocks:
        """The blocks of the receptance."""
        modal, n_dofs = self.blade, 3 * self.blade.n_contacts
        both = self._flexibility(omega)
        own = both[..., :n_dofs, :n_dofs]
        if modal.left is None:
            return RingBlocks(np.zeros_like(own), own, np.zeros_like(own))
        following = np.roll(both, -1, axis=0)
        return RingBlocks(
            -self._ahead.conj() * both[..., :n_dofs, n_dofs:],
            own + following[..., n_dofs:, n_dofs:],
            -self._ahead * following[..., n_dofs:, :n_dofs],
        )

    @cached_property
    def _faces(self) -> Array:
        """Motions of the faces of a blade, right then left."""
        return self.blade.right if self.blade.left is None else np.concatenate([self.blade.right, self.blade.left])

    @cached_property
    def _faces_of_poles(self) -> tuple[ComplexArray, ComplexArray]:
        """Motions of the faces of each blade by its poles, (N_b, 6 n_c, 2 m), and what these take of forces."""
        assert self.turning is not None
        return self._faces @ self.turning.shapes, self.turning.dual @ self._faces.T

    def _flexibility(self, omega: float) -> ComplexArray:
        """Motions of the faces of each blade, right then left, under forces on them, (N_b, n_h, 6 n_c, 6 n_c)."""
        inverse, faces = 1.0 / self.denominators(omega)[0].transpose(1, 0, 2), self._faces
        found = np.empty((*inverse.shape[:2], len(faces), len(faces)), complex)
        natural = np.full(self._harmonics.size, True)
        if self.turning is not None:
            natural = self._harmonics == 0.0
            moved, taken = self._faces_of_poles
            found[:, ~natural] = (moved[:, None] * inverse[:, ~natural, None]) @ taken[:, None]
        own = inverse[:, natural, None, : faces.shape[1]]
        found.real[:, natural] = (faces * own.real) @ faces.T
        found.imag[:, natural] = (faces * own.imag) @ faces.T
        return found

    def jacobian_blocks(self, omega: float, change: ComplexArray) -> CyclicBlocks:
        """The blocks of dR/dx; rows and columns of a block: coefficient, node, component."""
        blocks = self.blocks(omega)
        own = -real_product(blocks.own, change)
        own[:, np.arange(own.shape[1]), np.arange(own.shape[1])] += 1.0
        if self.blade.left is None:
            return CyclicBlocks(np.zeros_like(own), own, np.zeros_like(own))
        before = -real_product(blocks.before, np.roll(change, 1, axis=0))
        return CyclicBlocks(before, own, -real_product(blocks.after, np.roll(change, -1, axis=0)))

    def factorise(self, system: RingSystem) -> RingFactors:
        """Factors of a bordered Jacobian, by block elimination."""
        n_rows, end = system.n_rows, np.array([[system.corner]])
        column, row = (by_pair(each, n_rows, self.n_blades)[..., None] for each in (system.column, system.row))
        blocks, weight = self.jacobian_blocks(system.omega, system.change), self.row_weight
        for part in (*blocks, column):
            part[:, : len(weight)] = weight @ part[:, : len(weight)]
        return RingFactors(CyclicBlockFactors.of(blocks, column, row, end), n_rows, weight)

    @cached_property
    def row_weight(self) -> Array:
        """Weight (3 n_c, 3 n_c) of a residual of harmonic 0 that is large where a body is on a soft support.

        See `HarmonicBalance.weighted`; (0, 0) where there is none.
        """
        motions = np.linalg.qr(self.blade.right[:, : self.tuned.floating])[0]
        if not motions.size:
            return np.zeros((0, 0))
        return counted_at_contacts(np.eye(len(motions)), motions)


def ring_in_time(
    modal: ModalModel, contact: ContactParameters, excitation: Excitation, mistuning: Mistuning, output: str = "tip"
) -> Ring:
    """The ring of clamped blades that differ, for time integration; `contact` of the tuned pair."""
    tuned = Ring(modal, contact, excitation, output)
    blades = RingReceptance(tuned.excited, 1.0 + mistuning.frequency)
    return replace(tuned, contact=mistuning.contact(contact), blades_apart=blades)
