"""Poles of the blade ring with linear contact springs: the exponents while no contact changes its state."""

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from rom import ModalModel, RingModes, relative_contact_motion, spring_stiffness

SAMPLED = 7  # nodal diameters of a ring at which a search starts


def least_damped_pole(modal: RingModes, phase: float, springs: Array) -> complex:
    """The pole with the largest real part of the ring at one phase.

    With the modal coordinates q and the relative contact motion B = right - exp(i phase) left of the modes,

        s^2 q + diag(c_m) s q + (diag(omega_m^2) + B^H k B) q = 0.

    Shapes: `springs` (n_c, 3).
    """
    own = modal.at_phase(phase)
    elastic = own.angular_frequency > 0.0  # rigid motions of a disk do not move the contacts
    damping, squared = own.damping[elastic], own.angular_frequency[elastic] ** 2
    if not springs.any():
        half = damping / 2.0
        return _leading(-half + np.sqrt((half**2 - squared).astype(complex)))
    motion = _relative_motion(own, phase)[:, elastic]
    size = damping.size
    stiffness = np.diag(squared) + spring_stiffness(motion, springs)
    # velocities in units of this frequency, so that all entries are of one size
    scale = float(np.sqrt(np.abs(np.diag(stiffness)).max()))
    system = np.zeros((2 * size, 2 * size), dtype=stiffness.dtype)
    system[:size, size:] = np.eye(size)
    system[size:, :size] = -stiffness / scale**2
    system[size:, size:] = -np.diag(damping) / scale
    return _leading((scale * np.linalg.eigvals(system)).astype(complex))


def least_damped_of_ring(modal: RingModes, springs: Array) -> tuple[complex, int]:
    """The pole with the largest real part over all nodal diameters n = 0 .. N_b / 2 of the ring; -n has the same.

    For light damping the decay of a mode x, x^H x = 1, is that of its undamped shape, c = x^H diag(c_m) x / 2. It
    is formed at some nodal diameters and then at the neighbours of the least one, until there is no lesser one.
    Shapes: `springs` (n_c, 3).
    """
    assert modal.n_blades is not None
    pitch, last = 2.0 * np.pi / modal.n_blades, modal.n_blades // 2
    decays: dict[int, float] = {}

    def decay(n: int) -> float:
        if n not in decays:
            decays[n] = _undamped_decay(modal, n * pitch, springs)
        return decays[n]

    best = min(np.unique(np.linspace(0, last, SAMPLED).round().astype(int)).tolist(), key=decay)
    while (lower := min(range(max(best - 1, 0), min(best + 1, last) + 1), key=decay)) != best:
        best = lower
    return least_damped_pole(modal, best * pitch, springs), best


def _undamped_decay(modal: RingModes, phase: float, springs: Array) -> float:
    """The least x^H diag(c_m) x / 2 over the undamped modes x at one phase, 1/s."""
    own = modal.at_phase(phase)
    elastic = own.angular_frequency > 0.0
    motion, squared = _relative_motion(own, phase)[:, elastic], own.angular_frequency[elastic] ** 2
    _, shapes = np.linalg.eigh(np.diag(squared) + spring_stiffness(motion, springs))
    return float((own.damping[elastic] @ np.abs(shapes) ** 2).min()) / 2.0


def _relative_motion(modal: ModalModel, phase: float) -> ComplexArray | Array:
    """Relative contact motion of the modes, real where it can be."""
    motion = relative_contact_motion(modal.right, modal.left, np.array([phase]))[0]
    return motion.real if modal.left is None or abs(np.sin(phase)) < 1e-12 else motion


def _leading(poles: ComplexArray) -> complex:
    leading = complex(poles[np.argmax(poles.real)])
    return complex(leading.real, abs(leading.imag))
