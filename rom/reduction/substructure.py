"""The blade partitioned at its boundary dofs: constraint modes and condensed matrices.

With the interior dofs i and the boundary dofs b, the constraint modes Psi = -K_ii^-1 K_ib are the static responses of
the interior to unit boundary displacements (Craig and Bampton 1968). Condensation by them alone is Guyan's.

With averaged contact dofs the variables z of the displacements u = T z hold the averages in the places of a few nodes
p. T is the identity but for their rows. On the interior i, with the selections J of its unknowns and P of those of p,
T_i = J + P W, so that

    (T^T A T)_ii = J^T A J + C + C^T,    C = (J^T A P + W^T A_pp / 2) W,

where only the first term has the size of the mesh.

References
----------
R. J. Guyan, Reduction of stiffness and mass matrices, AIAA Journal 3 (1965) 380.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rom.finite_elements.full_model import FullModel
from rom.finite_elements.rotation import coriolis_acceleration
from rom.linear_algebra.block_lanczos import IsotropicMatrix
from rom.linear_algebra.factorisation import Factor, analyse
from rom.linear_algebra.threads import beside
from rom.reduction.boundary_dofs import BoundaryChoice, BoundaryDofs, InteriorLoads, choose_boundary_dofs
from rom.reduction.floating_bodies import Motions, floating_motions, without_rigid_motions

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from geometry.sector import SectorMesh
    from rom.reduction.boundary_dofs import BoundaryDofs


def partitioned(
    matrix: csr_matrix, interior: NDArray[np.int64], boundary: BoundaryDofs, per_node: int
) -> tuple[csr_matrix, csr_matrix, csr_matrix]:
    """Blocks ii, ib and bb of T^T A T for a symmetric A with `per_node` unknowns for each node of the mesh.

    The boundary unknowns are along x, y, z, not in their frames.
    """
    inside = _unknowns(interior, per_node)
    rows = matrix[inside]
    if boundary.variables is None:
        held = _unknowns(boundary.nodes, per_node)
        return rows[:, inside], rows[:, held], matrix[held][:, held]
    at_boundary = _for_each(boundary.variables[:, boundary.nodes], per_node)
    product = (matrix @ at_boundary).tocsr()
    replaced = boundary.nodes[: boundary.contact.sides]
    weights = _for_each(boundary.variables[replaced][:, interior], per_node)
    p = _unknowns(replaced, per_node)
    correction = ((rows[:, p] + 0.5 * (weights.T @ matrix[p][:, p])) @ weights).tocsr()
    correction = (correction + correction.T).tocsr()
    correction.sum_duplicates()
    return (
        _added(rows[:, inside], correction),
        (product[inside] + weights.T @ product[p]).tocsr(),
        (at_boundary.T @ product).tocsr(),
    )


def _added(matrix: csr_matrix, correction: csr_matrix) -> csr_matrix:
    """Sum of a matrix (n, n) and one with few rows that are not empty; the other rows are only copied."""
    from scipy.sparse import csr_matrix

    changed = np.flatnonzero(np.diff(correction.indptr))
    sums = (matrix[changed] + correction[changed]).tocsr()
    lengths = np.diff(matrix.indptr)
    lengths[changed] = np.diff(sums.indptr)
    starts = np.concatenate([[0], np.cumsum(lengths)]).astype(matrix.indptr.dtype)
    before, after = matrix.indptr[np.append(changed, matrix.shape[0])], np.append(0, matrix.indptr[changed + 1])

    def joined(of_matrix: NDArray[np.generic], of_sums: NDArray[np.generic]) -> NDArray[np.generic]:
        pieces = [of_matrix[after[0] : before[0]]]
        for k in range(len(changed)):
            pieces += [of_sums[sums.indptr[k] : sums.indptr[k + 1]], of_matrix[after[k + 1] : before[k + 1]]]
        return np.concatenate(pieces)

    arrays = joined(matrix.data, sums.data), joined(matrix.indices, sums.indices), starts
    return csr_matrix(arrays, shape=matrix.shape)


def _unknowns(nodes: NDArray[np.int64], per_node: int) -> NDArray[np.int64]:
    """Numbers of the unknowns of nodes (k,)."""
    return (per_node * nodes[:, None] + np.arange(per_node)).ravel()


def _for_each(matrix: csr_matrix, per_node: int) -> csr_matrix:
    """A matrix between nodes, for each of their unknowns alike."""
    from scipy.sparse import identity, kron

    return kron(matrix, identity(per_node), format="csr")


@dataclass(frozen=True)
class Substructure:
    """A full model with b boundary dofs and 3i dofs of i interior nodes; the clamped dofs are left out."""

    sector: SectorMesh  # the mesh
    boundary: BoundaryDofs  # boundary dofs and their frames
    # (i,), nodes that are neither boundary nodes nor clamped; with averaged contact dofs, the variables in their
    # places
    interior: NDArray[np.int64]
    # (3i, 3i), m_ii, a number for each pair of nodes where the mass is isotropic
    interior_mass: IsotropicMatrix | csr_matrix
    factor: Factor  # factor of K_ii. K_ii itself is not stored: it takes as much memory as that of the full model
    constraint: NDArray[np.float64]  # (3i, b), constraint modes Psi = -K_ii^-1 K_ib
    coupling: NDArray[np.float64]  # (3i, b), inertia of the interior under the constraint modes, L = M_ib + M_ii Psi
    # `stiffness`, `mass`: (b, b), guyan condensed matrices of the boundary dofs
    stiffness: NDArray[np.float64]
    mass: NDArray[np.float64]
    centrifugal: NDArray[np.float64]  # (N,), centrifugal force of the full model at 1 rad/s, on its variables
    # (b, b), Coriolis matrix of the boundary dofs with their constraint modes at 1 rad/s; None at rest
    coriolis: NDArray[np.float64] | None
    # (3i, b), inertia of the interior under the Coriolis accelerations A(C) of the constraint modes, rows i of M
    # A(C); None at rest and where the mass is isotropic: there it is that of A M, whose product with modes is known
    coriolis_inertia: NDArray[np.float64] | None
    element: str | None  # element of the full model
    speed_rpm: float  # speed of the full model, rev/min
    loads: InteriorLoads | None = None  # further loads and outputs

    @property
    def sources(self) -> NDArray[np.float64]:
        """Forces on the interior of which residual modes hold the static response: inertia L, and loads, (3i, k)."""
        return self.coupling if self.loads is None else np.hstack([self.coupling, self.loads.columns])

    @property
    def n_dofs(self) -> int:
        """Number of dofs of the full model, the clamped ones included."""
        return len(self.centrifugal)


@dataclass(frozen=True)
class HeldSector:
    """A sector held at its boundary dofs, with what couples these to the interior; see `Substructure`."""

    # `sector`, `boundary`, `interior`, `interior_mass`, `factor`: as in `Substructure`
    sector: SectorMesh
    boundary: BoundaryDofs
    interior: NDArray[np.int64]
    interior_mass: IsotropicMatrix | csr_matrix
    factor: Factor
    stiffness_ib: csr_matrix  # (3i, b), k_ib, boundary dofs in their frames
    stiffness_bb: NDArray[np.float64]  # (b, b), k_bb in these frames
    # `mass_ib`, `mass_bb`: (3i, 3k), m_ib and M_bb of the k nodes of the boundary, along x, y, z
    mass_ib: csr_matrix
    mass_bb: csr_matrix
    isotropic: bool  # whether the mass is isotropic
    # `centrifugal`, `element`, `speed_rpm`, `loads`: as in `Substructure`
    centrifugal: NDArray[np.float64]
    element: str | None
    speed_rpm: float
    loads: InteriorLoads | None
    floating: tuple[Motions, ...]  # rigid motions of bodies that contacts alone hold

    @property
    def size(self) -> int:
        """Number of interior dofs 3i."""
        return 3 * len(self.interior)

    def condensed(self) -> Substructure:
        """Solve for the constraint modes, and condense the matrices by them."""
        rotation, k_ib = self.boundary.rotation, self.stiffness_ib
        m_ib = (self.mass_ib @ _sparse(rotation.T)).tocsr()
        inertia = self.mass_bb @ rotation.T
        constraint = -self.factor.solve(k_ib.toarray())
        coupling = m_ib.toarray() + self.interior_mass @ constraint
        at_rest = self.speed_rpm == 0.0
        return Substructure(
            sector=self.sector,
            boundary=self.boundary,
            interior=self.interior,
            interior_mass=self.interior_mass,
            factor=self.factor,
            constraint=constraint,
            coupling=coupling,
            stiffness=without_rigid_motions(symmetric(self.stiffness_bb + k_ib.T @ constraint), self.floating),
            mass=symmetric(rotation @ inertia + m_ib.T @ constraint + constraint.T @ coupling),
            centrifugal=self.centrifugal,
            coriolis=None
            if at_rest
            else _condensed_coriolis(rotation, constraint, coupling, self.mass_ib.T @ constraint + inertia),
            coriolis_inertia=None
            if at_rest or self.isotropic
            else _coriolis_inertia(rotation, constraint, self.interior_mass, self.mass_ib),
            element=self.element,
            speed_rpm=self.speed_rpm,
            loads=self.loads,
        )


def hold_at_boundary(
    full: FullModel | Callable[[], FullModel], sector: SectorMesh, choice: BoundaryChoice, backend: str = "auto"
) -> HeldSector:
    """Partition a sector at its boundary dofs and factorise the stiffness of the interior.

    `full` is the full model, or a function that makes it; then the full model does not stay in memory.
    Raises RomParameterError for a loaded node that is clamped or a mesh without the contact dofs, FactorisationError
    when the structure is not held or not stable.
    """
    if not isinstance(full, FullModel):
        full = full()
    boundary = choose_boundary_dofs(full, sector, choice)
    interior = _interior_nodes(full, boundary)
    given = None if choice.loads is None else choice.loads(full)
    known: dict[str, Any] = {
        "sector": sector,
        "boundary": boundary,
        "interior": interior,
        "isotropic": full.isotropic_mass,
        "centrifugal": boundary.transform_force(full.centrifugal),
        "element": full.element,
        "speed_rpm": full.speed_rpm,
        "floating": floating_motions(full, boundary),
        "loads": InteriorLoads.of(given, boundary, interior, full.n_dofs)
        if given is not None and given.size
        else None,
    }
    k_ii, k_ib, k_bb = _stiffness_blocks(full.stiffness, interior, boundary)
    stiffness, mass = [k_ii], [full.mass]
    del k_ii, full  # before the factor is computed: on a large mesh there is little memory beside it

    def mass_blocks() -> tuple[IsotropicMatrix | csr_matrix, csr_matrix, csr_matrix]:
        return _mass_blocks(mass.pop(), interior, boundary, known["isotropic"])

    def factorise() -> Factor:
        analysis = analyse(stiffness[0], backend)
        stiffness.clear()
        return analysis.factor()

    (m_ii, m_ib, m_bb), factor = beside(3 * len(interior), mass_blocks, factorise)
    return HeldSector(
        interior_mass=m_ii, factor=factor, stiffness_ib=k_ib, stiffness_bb=k_bb, mass_ib=m_ib, mass_bb=m_bb, **known
    )


def partition_at_boundary(
    full: FullModel | Callable[[], FullModel], sector: SectorMesh, choice: BoundaryChoice
) -> Substructure:
    """Partition a sector at its boundary dofs and solve for the constraint modes; see `hold_at_boundary`."""
    return hold_at_boundary(full, sector, choice).condensed()


def _condensed_coriolis(
    rotation: NDArray[np.float64],
    constraint: NDArray[np.float64],
    coupling: NDArray[np.float64],
    at_boundary: NDArray[np.float64],
) -> NDArray[np.float64]:
    """C^T M A(C) (b, b) with the constraint modes C and their Coriolis accelerations A(C) at 1 rad/s.

    C is Psi inside and `rotation` (b, 3k) transposed at the nodes of the boundary; M C is `coupling` inside and
    `at_boundary` (3k, b). The acceleration of a motion of the cut faces is in general none of their motions.
    """
    product = coupling.T @ coriolis_acceleration(constraint) + at_boundary.T @ coriolis_acceleration(rotation.T)
    return 0.5 * (product - product.T)  # takes away round-off; of an anisotropic mass it is (M A + A M) / 2


def _coriolis_inertia(
    rotation: NDArray[np.float64],
    constraint: NDArray[np.float64],
    m_ii: IsotropicMatrix | csr_matrix,
    mesh_ib: csr_matrix,
) -> NDArray[np.float64]:
    """Rows i of M A(C), (3i, b)."""
    return np.asarray(m_ii @ coriolis_acceleration(constraint) + mesh_ib @ coriolis_acceleration(rotation.T))


def symmetric(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Symmetric part of a matrix: takes away round-off."""
    return 0.5 * (matrix + matrix.T)


def _interior_nodes(full: FullModel, boundary: BoundaryDofs) -> NDArray[np.int64]:
    """Nodes (i,) that are neither boundary nodes nor clamped."""
    inside = np.ones(len(full.positions), dtype=bool)
    inside[boundary.nodes] = False
    inside[full.fixed // 3] = False
    return np.flatnonzero(inside)


def _stiffness_blocks(
    matrix: csr_matrix, interior: NDArray[np.int64], boundary: BoundaryDofs
) -> tuple[csr_matrix, csr_matrix, NDArray[np.float64]]:
    """Blocks ii and ib sparse, bb dense; boundary dofs in their frames."""
    ii, ib, bb = partitioned(matrix, interior, boundary, 3)
    rotation = boundary.rotation
    return ii, (ib @ _sparse(rotation.T)).tocsr(), rotation @ (bb @ rotation.T)


def _mass_blocks(
    matrix: csr_matrix, interior: NDArray[np.int64], boundary: BoundaryDofs, isotropic: bool
) -> tuple[IsotropicMatrix | csr_matrix, csr_matrix, csr_matrix]:
    """Blocks ii, ib and bb of the mass; boundary dofs along x, y, z.

    An isotropic mass has multiples of the identity for pairs of nodes. Others have rotary inertias, lumped masses or
    nodal frames.
    """
    from scipy.sparse import identity, kron

    if not isotropic:
        return partitioned(matrix, interior, boundary, 3)
    ii, ib, bb = partitioned(IsotropicMatrix.of(matrix).pairs, interior, boundary, 1)
    return IsotropicMatrix(ii), *(kron(block, identity(3), format="csr") for block in (ib, bb))


def _sparse(matrix: NDArray[np.float64]) -> csr_matrix:
    from scipy.sparse import csr_matrix

    return csr_matrix(matrix)


def load_selection(parts: Substructure, shapes: NDArray[np.float64]) -> dict[str, Any]:
    """Contact motions, outputs and forces of a model with the boundary dofs and shapes (3i, m) of the interior."""
    b = parts.boundary.size
    selected = boundary_selection(parts.boundary, np.eye(b, b + shapes.shape[1]))
    return selected if parts.loads is None else parts.loads.selection(selected, parts.constraint, shapes)


def boundary_selection(boundary: BoundaryDofs, motion: NDArray[np.float64]) -> dict[str, Any]:
    """Contact motions, outputs and excitation in n reduced coordinates, by argument of `ReducedModel`.

    motion (b, n): the boundary dofs, in their frames, for unit reduced coordinates.
    """
    load = boundary.direction @ boundary.node_displacement(boundary.loaded) @ motion
    tip = boundary.node_displacement(boundary.tip) @ motion
    right, left = boundary.contact.relative(motion[: 3 * boundary.contact.sides])
    interface = boundary.interface
    inner = motion[boundary.size - interface.size :] if interface is not None else motion[:0]
    return {
        "cyclic_right": None if interface is None else interface.right @ inner,
        "cyclic_left": None if interface is None else interface.left @ inner,
        "contact_right": right,
        "contact_left": left,
        "interfaces": boundary.contact.interfaces,
        "force_excitation": load,
        "outputs": {"tip": load, "tip_x": tip[0], "tip_y": tip[1], "tip_z": tip[2]},
    }
