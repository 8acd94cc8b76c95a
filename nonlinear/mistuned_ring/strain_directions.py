"""The few strains of a blade on a disk on which its deviating stiffness acts.

The stiffness of blade j is ((1 + delta_j)^2 - 1) K_b above the tuned one, with the reduced stiffness K_b = S^T S of
the blade. Of all strains S q those count that vibrations in the frequency range have: with orthonormal directions Q,
K_b is replaced by S^T Q Q^T S. A mode of the ring has its frequency changed by mistuning through its strain energy in
the blades; Q is as wide as it needs to be for the energy neglected to be below `NEGLECTED` of that of every mode.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.mistuned_ring.linear_contacts import springs_in_state, supported_stiffness
from rom import ModalModel, RelativeReceptance, SectorModes, relative_contact_motion, strain_rows

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
        pressed[:, 2] = np.maximum(contact.initial_load, 0.0)
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
