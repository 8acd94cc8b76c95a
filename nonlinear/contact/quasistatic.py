"""Contact element for statics: harmonic 0 alone, sliders starting from their origin."""

from dataclasses import dataclass

import numpy as np

from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK, Array, ContactForces, ContactParameters


@dataclass(frozen=True)
class QuasistaticContact:
    """Contact element for a constant displacement (see `ContactElement` with H = 0)."""

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
