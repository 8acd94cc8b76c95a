"""Arrays of the compiled kernels that advance a ring of blades in time.

The motion of the blades is the response to the excitation without contact, in closed form, plus the response to the
contact forces, which is integrated. So the excitation has no error of integration.
"""

from typing import NamedTuple

import numpy as np

from nonlinear.contact.parameters import Array
from nonlinear.time_integration.modal_propagation import propagation
from nonlinear.time_integration.residual_flexibility import RetainedModes


class NodeLaw(NamedTuple):
    """Contact parameters (n_c,) of the nodes; `initial_load` is N0 + kn v0."""

    normal_stiffness: Array
    tangential_stiffness: Array
    friction: Array
    initial_load: Array
    preload: Array
    cone: bool


class RingSystem(NamedTuple):
    """What a step needs, for m retained modes and r = 3 n_c contact displacements of a pair of faces.

    `own`, `previous` and `following` hold the motion of a pair of faces under a unit force at the end of the step, on
    the pair itself, on the one before it and on the one after it. The row belongs to the force.
    """

    position: Array  # (4, m): modal coordinates over a step, see `propagation`
    rate: Array  # (4, m): their rates
    right: Array  # (r, m)
    left: Array  # (r, m)
    right_modes: Array  # (m, r): the transposes
    left_modes: Array  # (m, r)
    own: Array  # (r, r), m/N
    previous: Array  # (r, r)
    following: Array  # (r, r)
    free_motion: Array  # (2H+1, r): relative displacement without contact: static, cosine and sine of harmonic 1, ...
    free_output: Array  # (2H+1,): the same of the output
    output_modes: Array  # (m,)
    output_forces: Array  # (2, r): residual flexibility of the output to forces on its right and on its left pair
    waves: Array  # (q, 2): cosine and sine of j psi
    contact: NodeLaw


class RingWork(NamedTuple):
    """State of the ring and scratch arrays of the kernels."""

    coordinates: Array  # (q, m): contact-driven part of the retained modal coordinates
    rates: Array  # (q, m)
    modal_force: Array  # (q, m): of the contacts, at the end of the last step
    slider: Array  # (q, n_c, 2)
    placed: Array  # (q, n_c, 2): sliders at the end of the step that is being solved
    motion: Array  # (q, r): relative displacement at the end of the last step
    guess: Array  # (q, r): at the end of the step that is being solved
    force: Array  # (q, r): contact force on the right nodes
    last_force: Array  # (q, r): at the end of the last step
    earlier_force: Array  # (q, r): one step before
    change: Array  # (r,): of the forces on one pair of faces in a visit of its nodes
    load: Array  # (q, n_c): N0 + kn (v0 + d_n) at the beginning of the step
    slip: Array  # (q, n_c, 2): slip direction of the cone there; 0: none


def ring_system(modes: RetainedModes, omega: float, steps: int, n_blades: int) -> RingSystem:
    """Form the arrays of q blades at `omega` (rad/s) with `steps` a period."""
    ring, kept = modes.ring, modes.retained
    modal, contact = ring.modal, ring.contact
    right = modal.right
    left = np.zeros_like(right) if modal.left is None else modal.left
    step = 2.0 * np.pi / omega / steps
    position, rate = propagation(modal.angular_frequency[kept], modal.damping[kept], step)
    at_end = modes.flexibility.copy()
    at_end[kept] = position[3]
    own = (right * at_end) @ right.T + (left * at_end) @ left.T
    previous = -(left * at_end) @ right.T  # [force, motion]
    following = -(right * at_end) @ left.T
    if n_blades == 1:
        own, previous, following = own + previous + following, 0.0 * previous, 0.0 * following
    linear = ring.excited
    coordinates, _ = linear.modal_response(omega, np.zeros((len(linear.harmonics), right.shape[0]), dtype=complex))
    output = modal.outputs[ring.output]
    angles = ring.phase * np.arange(n_blades)
    return RingSystem(
        position=position,
        rate=rate,
        right=np.ascontiguousarray(right[:, kept]),
        left=np.ascontiguousarray(left[:, kept]),
        right_modes=np.ascontiguousarray(right[:, kept].T),
        left_modes=np.ascontiguousarray(left[:, kept].T),
        own=np.ascontiguousarray(own),
        previous=np.ascontiguousarray(previous),
        following=np.ascontiguousarray(following),
        free_motion=_rows(np.einsum("hrm,hm->hr", linear.relative, coordinates)),
        free_output=_rows(coordinates @ output),
        output_modes=np.ascontiguousarray(output[kept]),
        output_forces=np.stack([right, -left]) @ (modes.flexibility * output),
        waves=np.stack([np.cos(angles), np.sin(angles)], axis=1),
        contact=NodeLaw(
            contact.normal_stiffness,
            contact.tangential_stiffness,
            contact.friction,
            contact.initial_load,
            contact.preload,
            contact.law == "cone",
        ),
    )


def _rows(coefficients: np.ndarray) -> Array:
    """x_0 + Re sum_h x_h e^(i h theta) as the static part and the factors of cosine and sine, (2H+1, ...)."""
    rows = [part for harmonic in coefficients[1:] for part in (harmonic.real, -harmonic.imag)]
    return np.stack([coefficients[0].real, *rows])
