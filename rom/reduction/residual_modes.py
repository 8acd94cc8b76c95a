"""Residual modes: vectors that stand for the fixed-interface modes left out of a reduced model.

Let L be the inertia of the interior under the constraint modes and m_k = L^T phi_k. A fixed-interface mode k
contributes w^4 m_k m_k^T / (w_k^2 - w^2) to the dynamic stiffness of the boundary dofs. At low frequencies the sum
over all modes left out is w^4 R with

    R = L^T K_ii^-1 L - sum over the modes at hand of m_k m_k^T / w_k^2,

which takes one static solution for each boundary dof. The vectors behind R, K_ii^-1 L orthogonalised to the modes at
hand, therefore stand for all modes left out. This is the residual flexibility of MacNeal, Rubin and Craig and Chang,
applied to the inertia forces at the fixed interface.

References
----------
R. H. MacNeal, A hybrid method of component mode synthesis, Computers & Structures 1 (1971) 581-601.
S. Rubin, Improved component-mode representation for structural dynamic analysis, AIAA Journal 13 (1975) 995-1006.
R. R. Craig, C.-J. Chang, On the use of attachment modes in substructure coupling for dynamic analysis,
18th Structures, Structural Dynamics and Materials Conference (1977), AIAA 77-405.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rom.cyclic.reduced_model import ReducedModel
from rom.linear_algebra.orthonormalisation import orthonormal_combinations
from rom.reduction.boundary_selection import load_selection
from rom.reduction.fixed_interface_modes import ModalBasis
from rom.reduction.substructure import Substructure, symmetric


def residual_vectors(parts: Substructure) -> NDArray[np.float64]:
    """K_ii^-1 L (3i, b): static responses of the interior to its inertia under the constraint modes, and to loads."""
    return parts.factor.solve(parts.sources)


def augmented_model(parts: Substructure, modes: ModalBasis, residual: NDArray[np.float64]) -> ReducedModel:
    """The Craig-Bampton model augmented by residual modes.

    Coordinates: boundary dofs, fixed-interface modes, residual vectors (3i, b) made orthogonal to the modes.
    """
    shapes, squared = modes.shapes, modes.omega[:, None] ** 2
    participation = parts.coupling.T @ shapes
    in_modes = (participation.T if parts.loads is None else shapes.T @ parts.sources) / squared
    remainder = residual - shapes @ in_modes
    correction = shapes.T @ (parts.interior_mass @ remainder)  # the difference may be small: orthogonalise twice
    remainder -= shapes @ correction
    before = np.sum(residual * (parts.interior_mass @ residual), axis=0)
    chosen = orthonormal_combinations(remainder.T @ (parts.interior_mass @ remainder), before)
    remainder = remainder @ chosen
    # K_ii times the remainder without K_ii: times the residual vectors it is L, times the modes w^2 M_ii times them.
    forces = (parts.sources - (parts.interior_mass @ shapes) @ (squared * (in_modes + correction))) @ chosen
    b, m = parts.boundary.size, len(modes)
    n = b + m + remainder.shape[1]
    mass, stiffness = np.eye(n), np.zeros((n, n))
    mass[:b, :b], stiffness[:b, :b] = parts.mass, parts.stiffness
    mass[:b, b:] = np.hstack([participation, parts.coupling.T @ remainder])
    mass[b:, :b] = mass[:b, b:].T
    stiffness[b : b + m, b : b + m] = np.diag(modes.omega**2)
    stiffness[b + m :, b + m :] = symmetric(remainder.T @ forces)
    return ReducedModel(
        mass=mass,
        stiffness=stiffness,
        contact_position=parts.boundary.contact.position,
        contact_area=parts.boundary.contact.area,
        n_blades=parts.sector.n_blades,
        **load_selection(parts, np.hstack([shapes, remainder])),
    )
