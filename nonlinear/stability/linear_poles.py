"""Poles of the blade ring with linear contact springs: the exponents while no contact changes its state."""

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from rom import ModalModel, relative_contact_motion, spring_stiffness


def least_damped_pole(modal: ModalModel, phase: float, springs: Array) -> complex:
    """The pole with the largest real part of the ring at one phase.

    With the modal coordinates q and the relative contact motion B = right - exp(i phase) left of the modes,

        s^2 q + diag(c_m) s q + (diag(omega_m^2) + B^H k B) q = 0.

    Parameters
    ----------
    modal : ModalModel
        The contact-free modes.
    phase : float
        Inter-blade phase angle, rad.
    springs : (n_c, 3)
        Contact springs k along t1, t2 and n, N/m.

    Returns
    -------
    complex
        s, 1/s; of a conjugate pair the one that is not below the real axis.
    """
    if not springs.any():
        half = modal.damping / 2.0
        return _leading(-half + np.sqrt((half**2 - modal.angular_frequency**2).astype(complex)))
    motion = relative_contact_motion(modal.right, modal.left, np.array([phase]))[0]
    if modal.left is None or abs(np.sin(phase)) < 1e-12:
        motion = motion.real
    size = modal.damping.size
    stiffness = np.diag(modal.angular_frequency**2) + spring_stiffness(motion, springs)
    # velocities in units of this frequency, so that all entries are of one size
    scale = float(np.sqrt(np.abs(np.diag(stiffness)).max()))
    system = np.zeros((2 * size, 2 * size), dtype=stiffness.dtype)
    system[:size, size:] = np.eye(size)
    system[size:, :size] = -stiffness / scale**2
    system[size:, size:] = -np.diag(modal.damping) / scale
    return _leading((scale * np.linalg.eigvals(system)).astype(complex))


def _leading(poles: ComplexArray) -> complex:
    leading = complex(poles[np.argmax(poles.real)])
    return complex(leading.real, abs(leading.imag))
