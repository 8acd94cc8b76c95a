"""The blade split at its kept dofs: static answers to their motion, and how the inside is coupled to them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.finite_elements.full_model import FullModel, node_dofs
from rom.linear_algebra.factorisation import Factor, analyse
from rom.reduction.boundary_dofs import BoundaryDofs, choose_boundary_dofs

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from geometry import SectorMesh


@dataclass(frozen=True)
class Substructure:
    """A full model with b kept dofs and 3i dofs of i interior nodes; the clamped ones are gone.

    Attributes
    ----------
    kept : the kept dofs and their frames.
    interior : (i,) nodes that are neither kept nor clamped; with averages for contact dofs, what the variables
        `kept.variables` hold in their places.
    inner_mass : (3i, 3i) CSR, M_ii.
    factor : of K_ii, which itself is not kept: it takes as much memory as the full model's.
    constraint : (3i, b) constraint modes, Psi = -K_ii^-1 K_ib.
    coupling : (3i, b) inertia of the inside under the constraint modes, L = M_ib + M_ii Psi.
    stiffness, mass : (b, b) condensed to the kept dofs (Guyan).
    centrifugal : (N,) nodal forces of the full model at 1 rad/s, on its variables.
    element, speed_rpm : of the full model, as there.
    """

    kept: BoundaryDofs
    interior: NDArray[np.int64]
    inner_mass: csr_matrix
    factor: Factor
    constraint: NDArray[np.float64]
    coupling: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    mass: NDArray[np.float64]
    centrifugal: NDArray[np.float64]
    element: str
    speed_rpm: float

    @property
    def n_dofs(self) -> int:
        """Number of dofs of the full model, the clamped ones included."""
        return len(self.centrifugal)


def split(
    full: FullModel | Callable[[], FullModel],
    sector: SectorMesh,
    excitation_at: str | ArrayLike,
    backend: str = "auto",
    contact_dofs: str = "nodal",
) -> Substructure:
    """Split a sector at its contact, tip and loaded dofs; contact_dofs as in `ReductionOptions`.

    full: the full model, or what makes one, which then does not stay in memory.
    Raises RomParameterError for a loaded point out of place or contact dofs that cannot be had, FactorisationError
    when the structure is not held or not stable.
    """
    if not isinstance(full, FullModel):
        full = full()
    kept = choose_boundary_dofs(full, sector, excitation_at, contact_dofs)
    interior = _interior_nodes(full, kept)
    centrifugal, element, speed_rpm = kept.forces(full.centrifugal), full.element, full.speed_rpm
    k_ii, k_ib, k_bb = _partition(kept.quadratic_form(full.stiffness), interior, kept)
    analysis = analyse(k_ii, backend)
    del k_ii  # before the factor comes, beside which there is little room on a large mesh
    factor = analysis.factor()
    m_ii, m_ib, m_bb = _partition(kept.quadratic_form(full.mass), interior, kept)
    del full
    constraint = -factor.solve(k_ib.toarray())
    coupling = m_ib.toarray() + m_ii @ constraint
    return Substructure(
        kept=kept,
        interior=interior,
        inner_mass=m_ii,
        factor=factor,
        constraint=constraint,
        coupling=coupling,
        stiffness=symmetric(k_bb + k_ib.T @ constraint),
        mass=symmetric(m_bb + m_ib.T @ constraint + constraint.T @ coupling),
        centrifugal=centrifugal,
        element=element,
        speed_rpm=speed_rpm,
    )


def symmetric(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Half the sum of a matrix and its transpose: takes away round-off."""
    return 0.5 * (matrix + matrix.T)


def _interior_nodes(full: FullModel, kept: BoundaryDofs) -> NDArray[np.int64]:
    """Nodes (i,) that are neither kept nor clamped."""
    inside = np.ones(len(full.positions), dtype=bool)
    inside[kept.nodes] = False
    inside[full.fixed // 3] = False
    return np.flatnonzero(inside)


def _partition(
    matrix: csr_matrix, interior: NDArray[np.int64], kept: BoundaryDofs
) -> tuple[csr_matrix, csr_matrix, NDArray[np.float64]]:
    """Blocks (interior, interior) and (interior, kept) sparse, (kept, kept) dense, kept dofs in their frames."""
    from scipy.sparse import csr_matrix

    inside, dofs, rotation = node_dofs(interior).ravel(), kept.dofs, csr_matrix(kept.rotation)
    rows = matrix[inside]
    corner = rotation @ matrix[dofs][:, dofs] @ rotation.T
    return rows[:, inside], rows[:, dofs] @ rotation.T, corner.toarray()
