"""Receptance of a ring of sectors joined at a disk, whose blades differ.

A force on one sector moves all of them, through the disk. In the wave l of a ring of N sectors, each in the time of
its own blade, the sectors have the phase h psi + 2 pi l / N from one to the next and modes of their own. With the
discrete Fourier transform over the sectors, x_j = N^(-1/2) sum_l exp(2 pi i j l / N) x_l,

    eta_l = (F_l + B_l^H f_l) / D_l,    D_l = omega_l^2 + i h omega c_l - (h omega)^2,    d_l = B_l eta_l,

where F_l is there in the wave 0 alone. The stiffness by which blade j differs acts like more contact nodes, with
linear springs: B_l holds the rows Q^T S of `strain_directions` below those of the contact motion.

The stiffness of blade j is ((1 + delta_j)^2 - 1) K_b above the tuned one, with the reduced stiffness K_b = S^T S of
the blade. Of all strains S q those count that vibrations in the frequency range have: with orthonormal directions Q,
K_b is replaced by S^T Q Q^T S. A mode of the ring has its frequency changed by mistuning through its strain energy in
the blades; Q is as wide as it needs to be for the energy neglected to be below `NEGLECTED` of that of every mode.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.mistuned_ring.linear_contacts import springs_in_state, supported_stiffness
from rom import ModalModel, RelativeReceptance, SectorModes, WaveModes, relative_contact_motion, strain_rows

if TYPE_CHECKING:
    from nonlinear.mistuned_ring.sector_factors import NearFactors


HIGHEST = 3.0  # of the modes, relative to the upper end of the range
NEGLECTED = 1e-5  # strain energy of a mode outside the directions, of its whole strain energy
_NONE = 1e-14  # of the largest squared frequency: a rigid motion


def strain_directions(tuned: RelativeReceptance, contact: ContactParameters, highest: float) -> Array:
    """Rows that give the strains of a blade: half the sum of their squares is its strain energy.

    Shapes: returns (t, n).
    """
    modal = tuned.modal
    assert isinstance(modal, SectorModes)
    rows = blade_strain(modal)
    found = [rows @ each for each in _motions(tuned, contact, HIGHEST * highest)]
    columns = np.concatenate([part for each in found for part in (each.real, each.imag)], axis=1)
    left = np.linalg.svd(columns, full_matrices=False)[0]
    left_out = (columns**2).sum(axis=0) - np.cumsum((left.T @ columns) ** 2, axis=0)
    count = 1 + int(np.argmax(left_out.max(axis=1) <= NEGLECTED))
    count = min(3 * -(-count // 3), len(rows))
    chosen = left[:, :count].T @ rows
    return np.pad(chosen, ((0, -count % 3), (0, 0)))


def blade_strain(modal: SectorModes) -> Array:
    """S (r, n), S^T S the stiffness of the blade."""
    stiffness = modal.model.blade_stiffness
    assert stiffness is not None  # asked for before
    return strain_rows(stiffness)


def _motions(tuned: RelativeReceptance, contact: ContactParameters, highest: float) -> Iterator[ComplexArray]:
    """Motions (n, k) of unit strain energy: modes of all waves, and responses to the forces."""
    modal, n_contacts = tuned.modal, contact.n_contacts
    assert isinstance(modal, SectorModes)
    states = [springs_in_state(contact, state) for state in ("free", "sliding", "stuck")]
    phase = modal.phase(round(tuned.phase * modal.n_blades / (2.0 * np.pi)))
    for springs in states:
        for n in range(modal.n_blades // 2 + 1):
            modes = modal.at(n)
            squared, shapes = np.linalg.eigh(supported_stiffness(modes, 2.0 * np.pi * n / modal.n_blades, springs))
            elastic = (squared > _NONE * squared[-1]) & (squared <= highest**2)
            yield modes.shapes @ shapes[:, elastic] / np.sqrt(squared[elastic])
        still, excited = modal.at(0), modal.at_phase(phase)
        pressed = np.zeros((n_contacts, 3))
        pressed[:, 2] = contact.normal_load(np.zeros(n_contacts))
        pressing = relative_contact_motion(still.right, still.left, 0.0).conj().T @ pressed.reshape(-1)
        for force in (still.static_force, pressing):
            yield _response(still, springs, 0.0, force, 0.0)
        for share in (0.0, 0.5):
            yield _response(excited, springs, phase, excited.force, share * highest / HIGHEST)


def _response(
    modes: ModalModel, springs: Array, phase: float, force: NDArray[np.number], omega: float
) -> ComplexArray:
    """Response to a force at a frequency, of unit strain energy, (n, 1); (n, 0) without a force."""
    moving = modes.angular_frequency > 0.0
    if not np.any(force[moving]):
        return np.zeros((len(modes.shapes), 0), complex)
    stiffness = supported_stiffness(modes, phase, springs)[np.ix_(moving, moving)]
    found = np.linalg.solve(stiffness - omega**2 * np.eye(len(stiffness)), force[moving])
    size = np.sqrt((found.conj() @ stiffness @ found).real)
    return np.asarray((modes.shapes[:, moving] @ found / size)[:, None], dtype=complex)


class WaveChoice(NamedTuple):
    """Some modes of the waves of one harmonic."""

    wave: NDArray[np.intp]  # (w,) number l
    mode: NDArray[np.intp]  # (w,) number of the mode


@dataclass(frozen=True)
class SectorRing:
    """The structure of a ring of sectors joined at a disk."""

    tuned: RelativeReceptance  # the tuned sector with its phase psi, harmonics and excitation
    n_blades: int  # number N of sectors: that of the ring, or 1 where all move alike
    # (t, n), rows of the strains that mistuning needs, for unit reduced coordinates; t a multiple of three, or 0
    strain: Array

    @property
    def modal(self) -> SectorModes:
        """The modes of the tuned sector."""
        assert isinstance(self.tuned.modal, SectorModes)
        return self.tuned.modal

    @property
    def n_nodes(self) -> int:
        """Number of nodes of a pair, those of the strain counted."""
        return self.modal.n_contacts + len(self.strain) // 3

    @property
    def neighbours_only(self) -> bool:
        """Whether a force moves its own pair and the neighbouring ones alone."""
        return self.n_blades <= 3

    @cached_property
    def _harmonics(self) -> Array:
        return np.asarray(self.tuned.harmonics, dtype=float)

    @cached_property
    def _phases(self) -> Array:
        """Phases of the waves, (n_h, N), rad."""
        own = 2.0 * np.pi * np.arange(self.n_blades) / self.n_blades
        return self._harmonics[:, None] * self.tuned.phase + own

    @cached_property
    def waves(self) -> WaveModes:
        """Modes of all waves of all harmonics, n_h N rows; rigid motions have no static response."""
        return self.modal.waves(self._phases.ravel(), np.repeat(self._harmonics != 0.0, self.n_blades).tolist())

    @cached_property
    def motion(self) -> ComplexArray:
        """B_l: relative contact motion and strain of the modes, (n_h, N, 3 n_nodes, m)."""
        waves = self.waves
        found = np.zeros((len(waves.relative), 3 * self.n_nodes, waves.relative.shape[2]), complex)
        found[:, : waves.relative.shape[1]] = waves.relative
        if len(self.strain):
            for row, phase in zip(found[:, waves.relative.shape[1] :], self._phases.ravel(), strict=True):
                shapes = self.modal.at_phase(float(phase)).shapes
                row[:, : shapes.shape[1]] = self.strain @ shapes
        return found.reshape(*self._phases.shape, *found.shape[1:])

    @cached_property
    def adjoint(self) -> ComplexArray:
        """B_l^H, (n_h, N, m, 3 n_nodes)."""
        return np.ascontiguousarray(self.motion.conj().transpose(0, 1, 3, 2))

    @cached_property
    def _force(self) -> ComplexArray:
        """Modal forces of the waves, (n_h, N, m): the wave 0 holds those of the tuned sector."""
        found = np.zeros((*self._phases.shape, self.motion.shape[-1]), complex)
        own = self.tuned.modal_force[:, : found.shape[2]]
        found[:, 0, : own.shape[1]] = np.sqrt(self.n_blades) * own
        return found

    def denominators(self, omega: float) -> tuple[ComplexArray, ComplexArray]:
        """D_l and its derivative in omega, (n_h, N, m)."""
        shape = (*self._phases.shape, -1)
        h = self._harmonics[:, None, None]
        rate = 1j * h * self.waves.damping.reshape(shape)
        value = rate * omega + (self.waves.angular_frequency.reshape(shape) ** 2 - (h * omega) ** 2)
        return np.asarray(value, complex), np.asarray(rate - 2.0 * h**2 * omega, complex)

    def coordinates(self, omega: float, force: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Modal coordinates of all waves under the excitation and the forces at the nodes.

        Shapes: `force` (n_h, N, 3 n_nodes), returns `coordinates, derivatives` (n_h, N, m).
        """
        value, derivative = self.denominators(omega)
        found = (self._force + self._pushed(force)) / value
        return found, -derivative * found / value

    def increments(self, omega: float, force: ComplexArray) -> ComplexArray:
        """Change of the modal coordinates, (n_h, N, m), by changes of the forces (n_h, N, 3 n_nodes)."""
        found: ComplexArray = self._pushed(force) / self.denominators(omega)[0]
        return found

    def _pushed(self, force: ComplexArray) -> ComplexArray:
        found: ComplexArray = (self.adjoint @ np.fft.fft(force, axis=1, norm="ortho")[..., None])[..., 0]
        return found

    def relative(self, coordinates: ComplexArray) -> ComplexArray:
        """Relative displacements and strains of the pairs, (n_h, N, 3 n_nodes), of modal coordinates (n_h, N, m)."""
        found: ComplexArray = np.fft.ifft((self.motion @ coordinates[..., None])[..., 0], axis=1, norm="ortho")
        return found

    def response(self, omega: float, force: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Motion of the nodes under the excitation and the forces, and its derivative in omega, (n_h, N, 3 n_nodes).

        Shapes: `force` (n_h, N, 3 n_nodes).
        """
        coordinates, derivative = self.coordinates(omega, force)
        return self.relative(coordinates), self.relative(derivative)

    def output(self, name: str, coordinates: ComplexArray) -> ComplexArray:
        """An output of all blades, each in its own time, (N, n_h), of modal coordinates (n_h, N, m)."""
        rows = self._output_rows(name)
        return np.fft.ifft((rows * coordinates).sum(axis=-1), axis=1, norm="ortho").T

    def _output_rows(self, name: str) -> ComplexArray:
        if name not in self._outputs:
            rows = np.zeros((self._phases.size, self.motion.shape[-1]), complex)
            for row, phase in zip(rows, self._phases.ravel(), strict=True):
                own = self.modal.at_phase(float(phase)).outputs[name]
                row[: own.size] = own
            self._outputs[name] = rows.reshape(*self._phases.shape, -1)
        return self._outputs[name]

    @cached_property
    def _outputs(self) -> dict[str, ComplexArray]:
        return {}

    @cached_property
    def factors(self) -> dict[int, NearFactors]:
        """The last factors of a bordered Jacobian by its size, for the states that follow."""
        return {}

    def near_flexibility(
        self, omega: float, chosen: list[WaveChoice], size: int
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Flexibility of a pair, under forces on the pair before it, on itself and on the pair after it.

        Shapes: returns `before, own, after` (n_h, 3 n_nodes, size).
        """
        weight = 1.0 / self.denominators(omega)[0]
        for row, (wave, mode) in zip(weight, chosen, strict=True):
            row[wave, mode] = 0.0
        every = (self.motion * weight[:, :, None]) @ self.adjoint[..., :size]
        count = self.n_blades
        turn = np.exp(2j * np.pi * np.multiply.outer((1, 0, -1), np.arange(count)) / count) / count
        before, own, after = np.einsum("pl,hlab->phab", turn, every)
        nothing = np.zeros_like(own)
        return before if count > 1 else nothing, own, after if count > 2 else nothing

    def flexibility(self, omega: float) -> ComplexArray:
        """Flexibility of a pair under forces on the pairs 0, 1, 2, ... before it.

        Shapes: returns (N, n_h, 3 n_nodes, 3 n_nodes).
        """
        every = (self.motion / self.denominators(omega)[0][:, :, None]) @ self.adjoint
        return np.fft.ifft(every, axis=1).transpose(1, 0, 2, 3)


def wave_turns(count: int, wave: NDArray[np.intp]) -> ComplexArray:
    """N^(-1/2) exp(2 pi i j l / N) of the sectors j in some waves l, (N, w)."""
    found: ComplexArray = np.exp(2j * np.pi * np.outer(np.arange(count), wave) / count) / np.sqrt(count)
    return found
