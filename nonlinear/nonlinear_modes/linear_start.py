"""The linear mode from which a nonlinear mode starts."""

from __future__ import annotations

import numpy as np

from nonlinear.contact.fourier import ComplexArray, to_real
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.nonlinear_modes.extended_motion import MotionState
from rom import RelativeReceptance, contact_springs, spring_stiffness


def linear_mode(
    receptance: RelativeReceptance, contact: ContactParameters, share: Array, number: int
) -> tuple[float, float, ComplexArray]:
    """Frequency (rad/s), damping ratio and modal coordinates (m,) of one mode with linear contact springs.

    Shapes: `share` (n_c,).
    """
    from scipy.linalg import eigh

    waves, relative = receptance.waves, receptance.relative[1]
    springs = contact_springs(
        receptance.modal.n_contacts,
        contact.normal_stiffness * share,
        contact.tangential_stiffness * share * (contact.friction > 0.0),
    )
    matrix = np.diag(waves.angular_frequency[1] ** 2).astype(complex)
    matrix += spring_stiffness(relative, springs)
    squared, shapes = eigh(matrix, subset_by_index=(number - 1, number - 1))
    shape = np.asarray(shapes[:, 0], dtype=complex)
    omega = float(np.sqrt(squared[0]))
    damping = float(waves.damping[1] @ np.abs(shape) ** 2) / (2.0 * omega)
    return omega, damping, shape


def first_state(
    receptance: RelativeReceptance, mode: tuple[float, float, ComplexArray], static: Array, level: float
) -> tuple[int, MotionState]:
    """The carrier, which takes the largest part in a linear mode, and the state at the amplitude exp(`level`)."""
    omega, damping, shape = mode
    carrier = int(np.argmax(np.abs(shape)))
    shape = shape * (abs(shape[carrier]) / shape[carrier]) * np.exp(level)
    motion = np.zeros((len(receptance.harmonics), static.size), dtype=complex)
    motion[0] = static.reshape(-1)
    motion[1] = receptance.relative[1] @ shape
    displacement = to_real(motion).reshape(-1, *static.shape)
    return carrier, MotionState(displacement, float(shape[carrier].real), omega, damping, level)


def end_of_linear_motion(contact: ContactParameters, static: Array, motion: ComplexArray) -> float:
    """Modal amplitude up to which no node slips, lifts off or touches.

    Shapes: `static` (n_c, 3), `motion` (n_c, 3).
    """
    load = contact.unclipped_load(static[:, 2])
    swing = contact.normal_stiffness * np.abs(motion[:, 2])
    shear = contact.tangential_stiffness[:, None] * np.abs(motion[:, :2])
    rubs = (load > 0.0) & (contact.friction > 0.0)
    growth = swing.copy()
    growth[rubs] += shear.max(axis=1)[rubs] / contact.friction[rubs]
    moving = growth > 0.0
    return float(np.min(np.abs(load[moving]) / growth[moving], initial=np.inf))
