"""Arrays of the compiled kernels that advance a ring of blades in time.

The motion of the blades is the response to the excitation without contact, in closed form, plus the response to the
contact forces, which is integrated. So the excitation has no error of integration.
"""

from typing import NamedTuple

import numpy as np

from nonlinear.contact.parameters import Array, ContactParameters


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

    With a disk the fields that speak of modes are empty (see `DiskSystem`) but for `position` and `rate`.

    `own`, `previous` and `following` hold the motion of a pair of faces under a unit force at the end of the step, on
    the pair itself, on the one before it and on the one after it. The row belongs to the force. One blade is its
    own neighbour: `own` and `right` hold the whole, the left faces are left out.
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


def node_law(contact: ContactParameters) -> NodeLaw:
    """Contact parameters of the nodes of a pair of faces."""
    return NodeLaw(
        contact.normal_stiffness,
        contact.tangential_stiffness,
        contact.friction,
        contact.initial_load,
        contact.preload,
        contact.law == "cone",
    )


def cosine_rows(coefficients: np.ndarray) -> Array:
    """x_0 + Re sum_h x_h e^(i h theta) as the static part and the factors of cosine and sine, (2H+1, ...)."""
    rows = [part for harmonic in coefficients[1:] for part in (harmonic.real, -harmonic.imag)]
    return np.stack([coefficients[0].real, *rows])
