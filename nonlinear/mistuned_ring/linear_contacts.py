"""Contacts of a ring in one linear state: springs, stiffness of a wave with them, highest amplitude of any blade.

The stiffness of blade j on a disk is ((1 + delta_j)^2 - 1) K_b above the tuned one, with the reduced stiffness
K_b = S^T S of the blade. Of all strains S q those count that vibrations in the frequency range have: with orthonormal
directions Q, K_b is replaced by S^T Q Q^T S. A mode of the ring has its frequency changed by mistuning through its
strain energy in the blades; Q is as wide as it needs to be for the energy neglected to be below `NEGLECTED` of that
of every mode.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.options import OptionsError
from rom.cyclic.contact_springs import contact_springs, spring_stiffness
from rom.cyclic.cyclic_symmetry import relative_contact_motion
from rom.cyclic.modal_model import ModalModel
from rom.cyclic.receptance import RelativeReceptance
from rom.cyclic.sector_modes import RingModes
from rom.cyclic_sector.part_stiffness import strain_rows

HIGHEST = 3.0  # of the modes, relative to the upper end of the range
NEGLECTED = 1e-5  # strain energy of a mode outside the directions, of its whole strain energy
_NONE = 1e-14  # of the largest squared frequency: a rigid motion
PER_BANDWIDTH, LEAST, MOST = 4.0, 64, 20000  # frequencies of the search: in a half-power bandwidth, and in all
ZOOMS, ZOOM_POINTS = 5, 17
NEARLY_HIGHEST = 0.97  # of the largest sample: a maximum whose largest sample is lower is not the highest one

Vibration = Callable[[Array], ComplexArray]  # (F,) Hz to amplitudes (F, N_b), m


@dataclass(frozen=True)
class LinearPeak:
    """The highest amplitude of any blade of a linear ring."""

    frequency_hz: float
    amplitude_m: float  # amplitude of the output in the harmonic of the excitation, m
    blade: int  # number of the blade, 0 ... N_b - 1


def highest_peak(vibration: Vibration, bandwidth_hz: float, frequency_hz: tuple[float, float]) -> LinearPeak:
    """The highest amplitude of any blade between two frequencies."""
    low, high = frequency_hz
    wanted = PER_BANDWIDTH * (high - low) / max(bandwidth_hz, 1e-300)
    grid = np.linspace(low, high, int(min(max(wanted, LEAST), MOST)) + 1)
    top = np.abs(vibration(grid)).max(axis=1)
    padded = np.pad(top, 1, constant_values=-np.inf)
    local = (top >= padded[:-2]) & (top >= padded[2:]) & (top >= NEARLY_HIGHEST * top.max())
    starts = np.flatnonzero(local).tolist()
    found = [_zoomed(vibration, float(grid[max(i - 1, 0)]), float(grid[min(i + 1, grid.size - 1)])) for i in starts]
    return max(found, key=lambda peak: peak.amplitude_m)


def _zoomed(vibration: Vibration, low: float, high: float) -> LinearPeak:
    """The highest amplitude between two samples, by ever finer samples."""
    for _ in range(ZOOMS):
        grid = np.linspace(low, high, ZOOM_POINTS)
        amplitude = np.abs(vibration(grid))
        best, blade = divmod(int(np.argmax(amplitude)), amplitude.shape[1])
        low, high = float(grid[max(best - 1, 0)]), float(grid[min(best + 1, ZOOM_POINTS - 1)])
    return LinearPeak(float(grid[best]), float(amplitude[best, blade]), blade)


def springs_in_state(contact: ContactParameters, state: str) -> Array:
    """Springs of stuck, sliding or free contacts, (3 n_c,), N/m."""
    if state not in ("stuck", "sliding", "free"):
        raise OptionsError(f'state: {state!r}, allowed: "stuck", "sliding" or "free"')
    normal = contact.normal_stiffness * (state != "free")
    return contact_springs(contact.n_contacts, normal, contact.tangential_stiffness * (state == "stuck")).reshape(-1)


def supported_stiffness(modes: ModalModel, phase: float, springs: Array) -> ComplexArray:
    """Stiffness in the modes of the wave of a phase (rad) with contact springs (3 n_c,), (m, m)."""
    found: ComplexArray = spring_stiffness(relative_contact_motion(modes.right, modes.left, phase), springs)
    found[np.diag_indices_from(found)] += modes.angular_frequency**2
    return found


def strain_directions(tuned: RelativeReceptance, contact: ContactParameters, highest: float) -> Array:
    """Rows that give the strains of a blade: half the sum of their squares is its strain energy.

    Shapes: returns (t, n).
    """
    modal = tuned.modal
    rows = blade_strain(modal)
    found = [rows @ each for each in _motions(modal, tuned, contact, HIGHEST * highest)]
    columns = np.concatenate([part for each in found for part in (each.real, each.imag)], axis=1)
    left = np.linalg.svd(columns, full_matrices=False)[0]
    left_out = (columns**2).sum(axis=0) - np.cumsum((left.T @ columns) ** 2, axis=0)
    count = 1 + int(np.argmax(left_out.max(axis=1) <= NEGLECTED))
    count = min(3 * -(-count // 3), len(rows))
    chosen = left[:, :count].T @ rows
    return np.pad(chosen, ((0, -count % 3), (0, 0)))


def blade_strain(modal: RingModes) -> Array:
    """S (r, n), S^T S the stiffness of the blade: of a blade alone the whole one, whose modes have the strain w_m."""
    if isinstance(modal, ModalModel):
        return np.asarray(modal.angular_frequency[:, None] * np.linalg.pinv(modal.shapes))
    stiffness = modal.model.blade_stiffness
    assert stiffness is not None  # asked for before
    return strain_rows(stiffness)


def _motions(
    modal: RingModes, tuned: RelativeReceptance, contact: ContactParameters, highest: float
) -> Iterator[ComplexArray]:
    """Motions (n, k) of unit strain energy: modes of all waves, and responses to the forces."""
    n_contacts, n_blades = contact.n_contacts, modal.n_blades or 1
    states = [springs_in_state(contact, state) for state in ("free", "sliding", "stuck")]
    phase = modal.phase(round(tuned.phase * n_blades / (2.0 * np.pi)))
    for springs in states:
        for n in range(n_blades // 2 + 1):
            modes = modal.at(n)
            squared, shapes = np.linalg.eigh(supported_stiffness(modes, 2.0 * np.pi * n / n_blades, springs))
            felt = squared > _NONE * squared[-1]
            elastic = felt & (squared <= highest**2)
            own = shapes[:, elastic] / np.sqrt(squared[elastic])
            yield modes.shapes @ own
            if modes.coriolis is not None:  # what follows the Coriolis forces of these modes
                pushed = shapes[:, felt].conj().T @ (modes.coriolis @ (own * np.sqrt(squared[elastic])))
                yield modes.shapes @ (shapes[:, felt] @ (pushed / squared[felt, None]))
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
