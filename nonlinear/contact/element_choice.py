"""The contact element that the options ask for, that for statics, and a contact cycle in time for figures and checks.

The compiled elements are imported when they are needed.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray, basis_table, to_real
from nonlinear.contact.parameters import (
    LIFT_OFF,
    SLIP,
    STICK,
    Array,
    ContactElement,
    ContactForces,
    ContactParameters,
)
from nonlinear.options import SolverOptions, least_samples


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

    >>> from nonlinear import contact_cycle
    >>> from nonlinear.contact.parameters import SLIP, STICK
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
        if contact.cone[node]:
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


@dataclass(frozen=True)
class QuasistaticContact:
    """Contact element for statics: harmonic 0 alone, sliders starting from their origin (see `ContactElement`)."""

    parameters: ContactParameters

    def evaluate(self, displacement: Array) -> ContactForces:
        """Forces and Jacobian for `displacement` (1, n_c, 3): trial force kt (u - w0), returned to the limit mu N."""
        p = self.parameters
        displacement = p.from_slider_origin(displacement)
        u, normal = displacement[0, :, :2], p.normal_load(displacement[0, :, 2])
        pressed = normal > 0.0
        dn_dd = np.where(pressed, p.normal_stiffness, 0.0)
        limit = p.friction * normal
        trial = p.tangential_stiffness[:, None] * u
        size = np.where(p.cone[:, None], np.hypot(trial[:, :1], trial[:, 1:]), np.abs(trial))
        slipping = (size > limit[:, None]) & (p.tangential_stiffness[:, None] > 0.0)
        ratio = np.where(slipping, limit[:, None] / np.where(size > 0.0, size, 1.0), 1.0)
        direction = trial / np.where(size > 0.0, size, 1.0)

        reaction = np.concatenate([ratio * trial, (normal - p.preload)[:, None]], axis=1)
        jacobian = np.zeros((p.n_contacts, 3, 3))
        jacobian[:, 2, 2] = dn_dd
        stiffness = p.tangential_stiffness
        for a in range(2):
            jacobian[:, a, 2] = np.where(slipping[:, a], p.friction * dn_dd * direction[:, a], 0.0)
            jacobian[:, a, a] = np.where(slipping[:, a], 0.0, stiffness)
            for b in range(2):  # under the cone d(T) = ratio kt (1 - e e^T) du in slip
                across = (a == b) - direction[:, a] * direction[:, b]
                slip = p.cone & slipping[:, a]
                jacobian[:, a, b] = np.where(slip, ratio[:, a] * stiffness * across, jacobian[:, a, b])
        state = np.where(pressed, np.where(slipping.any(axis=1), SLIP, STICK), LIFT_OFF)
        return ContactForces(-reaction[None], -jacobian[:, :, :, None, None], state.astype(np.int64))


@dataclass(frozen=True)
class MixedContact:
    """Contact element of nodes under different laws: one element for the nodes of each (see `ContactElement`)."""

    parts: tuple[tuple[NDArray[np.bool_], ContactElement], ...]  # which nodes (n_c,), and their element

    def evaluate(self, displacement: Array) -> ContactForces:
        """Forces and Jacobian for real coefficients `displacement` (2H+1, n_c, 3), metres."""
        size, n_contacts, _ = displacement.shape
        force, state = np.empty(displacement.shape), np.empty(n_contacts, dtype=np.int64)
        jacobian = np.empty((n_contacts, 3, 3, size, size))
        for nodes, element in self.parts:
            found = element.evaluate(displacement[:, nodes])
            force[:, nodes], jacobian[nodes], state[nodes] = found.force, found.jacobian, found.state
        return ContactForces(force, jacobian, state)


CONE_WORK = 0.06  # of a node with the friction cone, for each displacement that is balanced there, as measured


def evaluation_work(element: ContactElement) -> float:
    """Work of contact forces with their Jacobian where it counts, millions of operations: that of friction cones."""
    if isinstance(element, MixedContact):
        return sum(evaluation_work(part) for _, part in element.parts)
    parameters = getattr(element, "parameters", None)
    if not isinstance(parameters, ContactParameters) or not parameters.cone.any():
        return 0.0
    from nonlinear.contact.cone_event_driven import EventDrivenCoulombCone

    if not isinstance(element, EventDrivenCoulombCone):
        return 0.0
    return CONE_WORK * 3 * parameters.n_contacts * (2 * element.n_harmonics + 1)


def contact_element(contact: ContactParameters, n_harmonics: int, options: SolverOptions) -> ContactElement:
    """Build the contact element that the options ask for."""
    if n_harmonics == 0:
        return QuasistaticContact(contact)
    if options.integration == "sampled":
        from nonlinear.contact.aft import AFTContact

        return AFTContact(contact, n_harmonics, max(options.samples, least_samples(n_harmonics)))
    if not isinstance(contact.law, str):
        kinds = contact.cone, ~contact.cone
        return MixedContact(
            tuple((nodes, contact_element(contact.at(nodes), n_harmonics, options)) for nodes in kinds)
        )
    if contact.law == "cone":
        from nonlinear.contact.cone_event_driven import EventDrivenCoulombCone

        return EventDrivenCoulombCone(contact, n_harmonics)
    from nonlinear.contact.event_driven import EventDrivenJenkins

    return EventDrivenJenkins(contact, n_harmonics)
