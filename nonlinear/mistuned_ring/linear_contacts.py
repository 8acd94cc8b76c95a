"""Contacts of a ring in one linear state: their springs, and the stiffness of a wave with them."""

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.options import OptionsError
from rom import ModalModel, contact_springs, relative_contact_motion, spring_stiffness


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
