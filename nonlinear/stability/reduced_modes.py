"""The modes of a blade with few contact motions: its lowest modes, and residual modes for all others.

References
----------
S. Rubin, Improved component-mode representation for structural dynamic analysis, AIAA Journal 13(8), 1975.
"""

from dataclasses import replace

import numpy as np

from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.stability.shared_motions import contact_weights
from rom import ModalModel

LEAST = 4  # residual modes


def reduced_modes(
    modal: ModalModel, contact: ContactParameters, kept: int, negligible: float, most: int, least: int = LEAST
) -> tuple[ModalModel, float]:
    """The lowest modes, and the static motions of all others that give most of the flexibility of the contact faces.

    The motions of both faces by the other modes, phi_m / omega_m, weighted by the square root of the contact
    stiffness, have the singular vectors V. V / omega are static motions of unit strain energy; their Ritz modes, with
    the mean damping of the modes in them, are the residual modes.
    """
    if kept + least >= modal.damping.size:
        return modal, 0.0
    assert modal.left is not None
    weight = contact_weights(contact)[:, None]
    frequency = modal.angular_frequency[kept:]
    faces = np.concatenate([weight * modal.right[:, kept:], weight * modal.left[:, kept:]])
    _, sizes, shapes = np.linalg.svd(faces / frequency, full_matrices=False)
    count = min(max(int(np.count_nonzero(sizes**2 > negligible)), least), max(most, least))
    static = shapes[:count].T / frequency[:, None]
    mass, vectors = np.linalg.eigh(static.T @ static)  # their stiffness is 1
    residual = (static @ vectors / np.sqrt(mass))[:, ::-1]

    def joined(face: Array) -> Array:
        return np.concatenate([face[:, :kept], face[:, kept:] @ residual], axis=1)

    reduced = replace(
        modal,
        angular_frequency=np.append(modal.angular_frequency[:kept], 1.0 / np.sqrt(mass[::-1])),
        damping=np.append(modal.damping[:kept], modal.damping[kept:] @ residual**2),
        right=joined(modal.right),
        left=joined(modal.left),
    )
    return reduced, float(sizes[count] ** 2) if count < sizes.size else 0.0
