"""Vectors that complete the basis of a reduced model: they stand for the fixed-interface modes that are left out.

With L the inertia of the inside under the constraint modes and m_k = L^T phi_k, a fixed-interface mode k takes
w^4 m_k m_k^T / (w_k^2 - w^2) from the dynamic stiffness of the kept dofs. The sum over all modes left out is known at
low frequencies, where it is w^4 R with R = L^T K_ii^-1 L - sum over the modes at hand of m_k m_k^T / w_k^2: one more
static solution for each kept dof. So the vectors behind R, K_ii^-1 L freed of the modes at hand, stand for all the
modes left out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.cyclic.reduced_model import ReducedModel
from rom.linear_algebra.orthonormalisation import independent
from rom.reduction.boundary_selection import boundary_selection
from rom.reduction.substructure import Substructure, symmetric

if TYPE_CHECKING:
    from geometry import SectorMesh


def residual_vectors(parts: Substructure) -> NDArray[np.float64]:
    """K_ii^-1 L (3i, b): the static answers of the inside to its inertia under the constraint modes."""
    return parts.factor.solve(parts.coupling)


def augmented_model(
    sector: SectorMesh,
    parts: Substructure,
    residual: NDArray[np.float64],
    angular: NDArray[np.float64],
    shapes: NDArray[np.float64],
    direction: NDArray[np.float64],
) -> ReducedModel:
    """Coordinates: kept dofs, modes, residual vectors (3i, b) made orthogonal to the modes.

    angular (m,) [rad/s], shapes (3i, m): fixed-interface modes; direction (3,): of the unit load.
    """
    part = parts.coupling.T @ shapes
    among = part.T / angular[:, None] ** 2
    rest = residual - shapes @ among
    again = shapes.T @ (parts.inner_mass @ rest)  # most of it may lie among the modes
    rest -= shapes @ again
    before = np.sum(residual * (parts.inner_mass @ residual), axis=0)
    chosen = independent(symmetric(rest.T @ (parts.inner_mass @ rest)), before)
    rest = rest @ chosen
    # K_ii on it without K_ii: L for the residual vectors, w^2 M_ii for the modes.
    forces = (parts.coupling - (parts.inner_mass @ shapes) @ (angular[:, None] ** 2 * (among + again))) @ chosen
    b, m = parts.kept.size, len(angular)
    n = b + m + rest.shape[1]
    mass, stiffness = np.eye(n), np.zeros((n, n))
    mass[:b, :b], stiffness[:b, :b] = parts.mass, parts.stiffness
    mass[:b, b:] = np.hstack([part, parts.coupling.T @ rest])
    mass[b:, :b] = mass[:b, b:].T
    stiffness[b : b + m, b : b + m] = np.diag(angular**2)
    stiffness[b + m :, b + m :] = symmetric(rest.T @ forces)
    return ReducedModel(
        mass=mass,
        stiffness=stiffness,
        contact_position=sector.right.position,
        n_blades=sector.n_blades,
        **boundary_selection(parts.kept, np.eye(b, n), direction),
    )
