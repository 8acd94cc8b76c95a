"""The choice of the contact element, and that for statics; the compiled ones are imported when they are needed."""

from dataclasses import dataclass

import numpy as np

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
        size = np.abs(trial) if p.law == "two_sliders" else np.hypot(trial[:, 0], trial[:, 1])[:, None] + 0.0 * trial
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
            if p.law == "cone":  # d(T) = ratio kt (1 - e e^T) du in slip
                for b in range(2):
                    across = (a == b) - direction[:, a] * direction[:, b]
                    slip = ratio[:, a] * stiffness * across
                    jacobian[:, a, b] = np.where(slipping[:, a], slip, stiffness * (a == b))
        state = np.where(pressed, np.where(slipping.any(axis=1), SLIP, STICK), LIFT_OFF)
        return ContactForces(-reaction[None], -jacobian[:, :, :, None, None], state.astype(np.int64))


def contact_element(contact: ContactParameters, n_harmonics: int, options: SolverOptions) -> ContactElement:
    """Build the contact element that the options ask for.

    Parameters
    ----------
    contact : ContactParameters
        Parameters of the nodes; `contact.law` tells two Jenkins elements per node from the friction cone.
    n_harmonics : int
        Number of harmonics H; 0: statics.
    options : SolverOptions
        `integration` "exact": event-driven; "sampled": AFT with at least `samples` samples.

    Returns
    -------
    ContactElement
        The element.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from nonlinear import contact_element
    >>> motion = np.zeros((3, 1, 3))
    >>> motion[1, 0, 0] = 0.1  # u1 = 0.1 cos(theta), m: kt u1 = 0.3 N is less than mu N0 = 1 N
    >>> forces = contact_element(contact, 1, options).evaluate(motion)
    >>> round(float(forces.force[1, 0, 0]), 6)  # N
    -0.3
    """
    if n_harmonics == 0:
        return QuasistaticContact(contact)
    if options.integration == "sampled":
        from nonlinear.contact.aft import AFTContact

        return AFTContact(contact, n_harmonics, max(options.samples, least_samples(n_harmonics)))
    if contact.law == "cone":
        from nonlinear.contact.cone_event_driven import EventDrivenCoulombCone

        return EventDrivenCoulombCone(contact, n_harmonics)
    from nonlinear.contact.event_driven import EventDrivenJenkins

    return EventDrivenJenkins(contact, n_harmonics)
