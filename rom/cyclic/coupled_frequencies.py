"""Natural frequencies of the ring with linear contact springs, from its modes with free contacts."""

import numpy as np
from numpy.typing import ArrayLike

from rom.cyclic.contact_springs import contact_springs, spring_stiffness, supported_frequencies
from rom.cyclic.cyclic_symmetry import relative_contact_motion
from rom.cyclic.receptance_series import SMALLEST_FACE
from rom.cyclic.reduced_model import Array
from rom.cyclic.ring_modes import RingModes


def coupled_frequencies(
    modal: RingModes,
    phase: float,
    *,
    normal: ArrayLike = 0.0,
    tangential: ArrayLike = 0.0,
    highest: float = np.inf,
) -> Array:
    """Undamped natural frequencies with linear contact springs, from the modes with free contacts.

    Parameters
    ----------
    modal : ModalModel or SectorModes
        The m modes with free contacts.
    phase : float
        Inter-blade phase angle, rad.
    normal, tangential : float or (n_c,) array
        Contact springs kn, kt of the nodes, N/m.
    highest : float
        Frequency (rad/s) above which none is needed; of large models they are left out.

    Returns
    -------
    (m,) array
        Natural frequencies in rad/s, ascending; with `highest` perhaps none above it.

    Examples
    --------
    Springs of three times the stiffness of the blade, to the ground, double its frequency:

    >>> from rom import ReducedModel, coupled_frequencies, modal_model
    >>> n, one = np.array([[0.0], [0.0], [1.0]]), np.ones(1)
    >>> model = ReducedModel(np.eye(1), 1e6 * np.eye(1), n, np.zeros((1, 3)), one, {"tip": one})
    >>> print(coupled_frequencies(modal_model(model, damping_ratio=0.01), phase=0.0, normal=3e6).round(6))
    [2000.]
    """
    springs = contact_springs(modal.n_contacts, normal, tangential)
    modal = modal.at_phase(phase)
    if not springs.any():
        return modal.angular_frequency
    relative = relative_contact_motion(modal.right, modal.left, phase)
    few = (
        modal.angular_frequency[0] > 0.0
        and 8 * np.count_nonzero(modal.angular_frequency <= highest) < modal.angular_frequency.size
    )
    if few and 3 * modal.n_contacts >= SMALLEST_FACE:
        found = supported_frequencies(modal.angular_frequency, relative, springs, highest)
        if found is not None:
            return found
    return np.sqrt(np.linalg.eigvalsh(np.diag(modal.angular_frequency**2) + spring_stiffness(relative, springs)))
