"""Forced response with linear contact springs: free, sliding or stuck contacts."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from rom.cyclic.contact_springs import SpringSupportedMotion, contact_springs
from rom.cyclic.receptance import RelativeReceptance
from rom.cyclic.reduced_model import Array, ComplexArray
from rom.cyclic.ring_modes import RingModes


def linear_response(
    modal: RingModes,
    frequency_hz: Sequence[float] | Array,
    *,
    phase: float,
    force: float,
    normal: ArrayLike = 0.0,
    tangential: ArrayLike = 0.0,
    output: str = "tip",
    harmonic: int = 1,
    harmonic_factors: tuple[tuple[int, complex], ...] = (),
) -> ComplexArray:
    """Response of one harmonic with linear contact springs: free (no springs), sliding or stuck contacts.

    Parameters
    ----------
    modal : ModalModel or SectorModes
        The modes, with damping.
    frequency_hz : (F,) sequence of float
        Excitation frequencies, Hz.
    phase : float
        Inter-blade phase angle, rad.
    force : float
        Amplitude of the excitation, N.
    normal, tangential : float or (n_c,) array
        Contact springs kn, kt of the nodes, N/m.
    output : str
        Name of the output.
    harmonic : int
        The harmonic h of the excitation, at h times the excitation frequency.
    harmonic_factors : tuple of (int, complex)
        Harmonics of the excitation, as in `RelativeReceptance`.

    Returns
    -------
    (F,) complex array
        Amplitude of the output, m.

    Examples
    --------
    Static displacement F / k, and F / (c w) at resonance:

    >>> from rom import ReducedModel, linear_response, modal_model
    >>> n, one = np.array([[0.0], [0.0], [1.0]]), np.ones(1)
    >>> model = ReducedModel(np.eye(1), 1e6 * np.eye(1), n, np.zeros((1, 3)), one, {"tip": one})
    >>> modal = modal_model(model, damping_ratio=0.01)
    >>> abs(linear_response(modal, [0.0, 500.0 / np.pi], phase=0.0, force=2.0)).round(9).tolist()
    [2e-06, 0.0001]
    """
    springs = contact_springs(modal.n_contacts, normal, tangential).reshape(-1)
    receptance = RelativeReceptance(modal, phase, (harmonic,), force, harmonic_factors)
    response = np.empty(len(frequency_hz), dtype=complex)
    for index, hertz in enumerate(frequency_hz):
        omega = 2.0 * np.pi * hertz
        contact_force = np.zeros(springs.size, dtype=complex)
        if np.any(springs):
            free, _ = receptance.response(omega, contact_force[None])
            contact_force = -springs * SpringSupportedMotion(receptance.matrix(omega)[0] * springs).solve(free[0])
        coordinates, _ = receptance.modal_response(omega, contact_force[None])
        response[index] = receptance.output(output, coordinates)[0]
    return response
