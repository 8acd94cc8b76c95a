"""Frequencies that a curve must not step over: linear resonances, which can be narrower than a step."""

import numpy as np

from nonlinear.contact import ContactParameters
from nonlinear.options import SolverOptions
from rom import RelativeReceptance, coupled_frequencies


def landmarks(
    receptance: RelativeReceptance, contact: ContactParameters, options: SolverOptions
) -> tuple[float, ...]:
    """Natural frequencies in the range with the contacts open, sliding and stuck, rad/s, ascending."""
    low, high = (2.0 * np.pi * limit for limit in options.frequency)
    springs = np.zeros((3, contact.n_contacts, 3))
    springs[1:, :, 2] = contact.normal_stiffness
    springs[2, :, :2] = contact.tangential_stiffness[:, None]
    found = [coupled_frequencies(receptance.modal, receptance.phase, row.reshape(-1)) for row in springs]
    inside = np.unique(np.concatenate(found))
    return tuple(inside[(inside > low) & (inside < high)].tolist())
