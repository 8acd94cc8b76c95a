"""Contact forces of a ring together with the forces of the stiffness by which its blades differ.

The deviating stiffness of blade j acts like linear springs at nodes of its own: f_j = -((1 + delta_j)^2 - 1) s_j with
the strain s_j = Q^T S q_j, see `strain_directions`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nonlinear.contact.parameters import STICK, Array, ContactElement, ContactForces


@dataclass(frozen=True)
class WithBladeSprings:
    """A contact element for the nodes of N pairs, each followed by the nodes of the strain of its blade."""

    contact: ContactElement  # the contact nodes, pair after pair
    n_contacts: int  # contact nodes of a pair, and nodes of the strain of a blade
    n_strain: int  # contact nodes of a pair, and nodes of the strain of a blade
    stiffness: Array  # (N,), (1 + delta_j)^2 - 1

    def evaluate(self, displacement: Array) -> ContactForces:
        """Forces and Jacobian for displacements and strains (2H+1, N (n_contacts + n_strain), 3)."""
        rows, count, own = displacement.shape[0], self.stiffness.size, self.n_contacts
        moved = displacement.reshape(rows, count, own + self.n_strain, 3)
        found = self.contact.evaluate(np.ascontiguousarray(moved[:, :, :own]).reshape(rows, -1, 3))
        force = np.empty_like(moved)
        force[:, :, :own] = found.force.reshape(rows, count, own, 3)
        force[:, :, own:] = -self.stiffness[:, None, None] * moved[:, :, own:]
        jacobian = np.zeros((count, own + self.n_strain, 3, 3, rows, rows))
        jacobian[:, :own] = found.jacobian.reshape(count, own, 3, 3, rows, rows)
        one = np.eye(3)[:, :, None, None] * np.eye(rows)
        jacobian[:, own:] = -self.stiffness[:, None, None, None, None, None] * one
        state = np.full((count, own + self.n_strain), STICK)
        state[:, :own] = found.state.reshape(count, own)
        return ContactForces(
            force.reshape(displacement.shape), jacobian.reshape(-1, 3, 3, rows, rows), state.reshape(-1)
        )
