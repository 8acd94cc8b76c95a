"""One contact cycle in the time domain: hysteresis loops and states, for figures and checks."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray, basis_table, to_real
from nonlinear.contact.parameters import LIFT_OFF, Array, ContactParameters


class ContactCycle(NamedTuple):
    """Samples over one period.

    Attributes
    ----------
    angle : (S,) float
        theta = omega t, rad.
    displacement : (S, n_c, 3) float
        Relative displacement (u1, u2, d_n), m.
    force : (S, n_c, 3) float
        Contact force (T1, T2, N), N; the preload is part of N.
    state : (S, n_c) int
        STICK, SLIP or LIFT_OFF.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from nonlinear import contact_cycle
    >>> cycle = contact_cycle(curve.relative_displacement[curve.peak.index], contact, samples=64)
    >>> cycle.force.shape, bool(np.all(np.abs(cycle.force[:, 0, 0]) < 0.5 * cycle.force[:, 0, 2] + 1e-9))
    ((64, 1, 3), True)
    """

    angle: Array
    displacement: Array
    force: Array
    state: NDArray[np.int64]


def contact_cycle(displacement: ComplexArray, contact: ContactParameters, samples: int = 256) -> ContactCycle:
    """Evaluate the steady contact cycle at equidistant instants of a period.

    Parameters
    ----------
    displacement : (H+1, n_c, 3) complex
        Coefficients d^(h) of the relative displacement, m: `ResponseCurve.relative_displacement` at a point.
    contact : ContactParameters
        Parameters of the nodes.
    samples : int
        Number of instants.

    Returns
    -------
    ContactCycle
        Displacement, force and state at the instants.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from nonlinear import SLIP, STICK, contact_cycle
    >>> motion = np.zeros((2, 1, 3), dtype=complex)
    >>> motion[1, 0, 0] = 0.5  # u1 = 0.5 cos(theta), m
    >>> cycle = contact_cycle(motion, contact, samples=64)
    >>> set(cycle.state.ravel().tolist()) == {STICK, SLIP}, float(cycle.force[:, 0, 0].max().round(6))  # mu N0
    (True, 1.0)
    """
    from nonlinear.contact.return_map import MAX_PERIODS, REPEAT_TOLERANCE, cone_return_map, jenkins_return_map

    real = contact.from_slider_origin(to_real(displacement))
    size, n_contacts, _ = real.shape
    table = basis_table((size - 1) // 2, samples)
    motion = (table @ real.reshape(size, -1)).reshape(samples, n_contacts, 3)
    force = np.zeros_like(motion)
    force[:, :, 2] = contact.normal_load(motion[:, :, 2])
    state = np.zeros((samples, n_contacts), dtype=np.int64)
    source, sign, single = (np.empty(samples, dtype=np.int64) for _ in range(3))
    for node, (kt, mu) in enumerate(zip(contact.tangential_stiffness, contact.friction, strict=True)):
        limit = mu * force[:, node, 2]
        if kt == 0.0:
            continue
        if contact.law == "cone":
            plane, traction = np.ascontiguousarray(motion[:, node, :2]), np.empty((samples, 2))
            tolerance = REPEAT_TOLERANCE * float(np.abs(plane).max())
            cone_return_map(plane, limit, kt, MAX_PERIODS, tolerance, state[:, node], traction)
            force[:, node, :2] = traction
            continue
        for direction in range(2):
            u = np.ascontiguousarray(motion[:, node, direction])
            jenkins_return_map(u, limit, kt, single, source, sign)
            moved = source >= 0
            position = np.where(moved, u[source] - sign * limit[source] / kt, 0.0)
            force[:, node, direction] = kt * (u - position)
            state[:, node] = np.maximum(state[:, node], single)
    state[force[:, :, 2] <= 0.0] = LIFT_OFF
    motion[:, :, :2] += contact.slider_origin
    return ContactCycle(2.0 * np.pi * np.arange(samples) / samples, motion, force, state)
