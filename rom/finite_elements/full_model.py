"""The finite element model of one sector before any reduction."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.finite_elements.assembly import elastic_matrices
from rom.finite_elements.discretisation import Discretisation, discretise
from rom.finite_elements.material import Materials
from rom.linear_algebra.threads import one_blas_thread
from rom.units import angular_speed

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from geometry.sector import SectorMesh

SHIFT = 1e-9  # of the largest ratio of stiffness to mass: makes the stiffness of a body that nothing holds definite
ABOVE_SOFTENING = 2.0  # of the speed squared, by which spin softening lowers the stiffness of a disk moved aside
TILTING = 10.0  # the same times radius over height, by which a body tilts out of the seat that bears its pull
HELD = 1e-6  # of the sum of the diagonal: a translation that meets more stiffness is held, stress stiffening is less


@dataclass(frozen=True)
class FullModel:
    """Matrices of one sector with n nodes, mid-side nodes included; N = 3n dofs ordered node-major x, y, z.

    Attributes
    ----------
    stiffness, mass : (N, N) CSR matrix
        Symmetric, N/m and kg. The clamped dofs are not removed.
    positions : (n, 3) array
        Nodes, m.
    vertex_node : (V,) array
        Node of each mesh vertex.
    fixed : (f,) array
        Sorted indices of the dofs on the clamped root.
    centrifugal : (N,) array
        Nodal forces at 1 rad/s about the x axis, N; they grow with the square of the speed. At a speed those whose
        static displacement is that of the equilibrium.
    element : str or None
        Element that the mesh was promoted to; None for the elements of the mesh.
    speed_rpm : float
        Speed, rev/min, about whose static equilibrium `stiffness` holds, 0 at rest.
    isotropic_mass : bool
        Whether the mass of a pair of nodes is a number times the identity, as that of solid elements.

    Examples
    --------
    Rigid motions of the free structure cause no force:

    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
    >>> from rom import Material, assemble
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> sector = build_sector(blade, shroud, MeshParameters(size=0.02))
    >>> full = assemble(sector, Material(2e11, 0.3, 7800.0), element="hex8")
    >>> bool(np.abs(full.stiffness @ np.ones(full.n_dofs)).max() < 1e-9 * full.stiffness.diagonal().max())
    True
    """

    stiffness: csr_matrix
    mass: csr_matrix
    positions: NDArray[np.float64]
    vertex_node: NDArray[np.int64]
    fixed: NDArray[np.int64]
    centrifugal: NDArray[np.float64]
    element: str | None
    speed_rpm: float = 0.0
    isotropic_mass: bool = True

    @property
    def n_dofs(self) -> int:
        """Number of dofs, the clamped ones included."""
        return 3 * len(self.positions)

    @cached_property
    def floating(self) -> tuple[NDArray[np.int64], ...]:
        """Nodes of each body that nothing holds: no clamped node, and no stiffness left of one.

        Matrices of other programs may come without their clamped dofs.
        """
        from scipy.sparse.csgraph import connected_components

        body = np.asarray(connected_components(self.stiffness, directed=False)[1])[::3]
        free = [np.flatnonzero(body == k) for k in np.setdiff1d(body, body[self.fixed // 3])]
        return tuple(nodes for nodes in free if not self._held(nodes))

    def _held(self, nodes: NDArray[np.int64]) -> bool:
        """Whether the translation of some nodes meets stiffness."""
        moved = np.zeros((len(self.positions), 3, 3))
        moved[nodes] = np.eye(3)
        energy = np.einsum("ij,ij->j", columns := moved.reshape(-1, 3), self.stiffness @ columns)
        return bool(energy.max() > HELD * self.stiffness.diagonal()[columns.any(axis=1)].sum())


def floating_shift(full: FullModel, joined: ArrayLike = ()) -> float:
    """Number s with K + s M definite, (rad/s)^2: 0 where every body is held.

    `joined`: nodes at which bodies are joined to those of the neighbours.
    """
    if not full.floating:
        return 0.0
    ratio = ABOVE_SOFTENING
    for nodes in full.floating:
        if not np.isin(joined, nodes).any():
            at = full.positions[nodes]
            ratio = max(ratio, TILTING * float(np.hypot(at[:, 1], at[:, 2]).max() / np.ptp(at, axis=0).min()))
    stiffness, mass = full.stiffness.diagonal(), full.mass.diagonal()
    return max(SHIFT * float((stiffness / mass).max()), ratio * angular_speed(full.speed_rpm) ** 2)


@one_blas_thread()
def assemble(sector: SectorMesh, material: Materials, element: str | None = "hex20") -> FullModel:
    """Assemble stiffness, mass and centrifugal force of a sector.

    Parameters
    ----------
    sector : SectorMesh
        The mesh; its node set `root` is clamped.
    material : Material or mapping of str to Material
        The material, or the materials by the names that the blocks of the mesh have, "" for those without one.
    element : {"hex20", "hex27", "hex8"} or None
        The element that a mesh of 8-node hexahedra is promoted to; mid-side nodes lie half-way between the vertices.
        None takes the elements of the mesh as they are, with their mid-side nodes on curved edges.

    Returns
    -------
    FullModel
        The model at rest.

    Raises
    ------
    RomParameterError
        The element is unknown, the mesh cannot be promoted to it, a material is not given, or an element of the mesh
        is turned inside out.

    Examples
    --------
    The mass is density times volume of airfoil and shroud:

    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
    >>> from rom import Material, assemble
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> sector = build_sector(blade, shroud, MeshParameters(size=0.02))
    >>> full = assemble(sector, Material(2e11, 0.3, 7800.0), element="hex8")
    >>> along_x = np.tile([1.0, 0.0, 0.0], len(full.positions))
    >>> round(float(along_x @ full.mass @ along_x), 3)
    0.306
    """
    discretisation = discretise(sector, element)
    stiffness, mass = elastic_matrices(discretisation, material)
    root = discretisation.nodes_on(np.asarray(sector.node_sets["root"]))
    return FullModel(
        stiffness=stiffness,
        mass=mass,
        positions=discretisation.positions,
        vertex_node=discretisation.vertex_node,
        fixed=node_dofs(root).ravel(),
        centrifugal=centrifugal_force(discretisation, mass),
        element=element,
    )


def centrifugal_force(discretisation: Discretisation, mass: csr_matrix) -> NDArray[np.float64]:
    """Nodal forces (3n,) of the centrifugal load rho (0, y, z) per volume at 1 rad/s about x.

    The positions lie in the span of the shape functions, so the mass matrix integrates the load exactly.
    """
    arm = discretisation.positions.copy()
    arm[:, 0] = 0.0
    return mass @ arm.ravel()


def node_dofs(nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Dof indices (k, 3) of the nodes (k,)."""
    return 3 * np.asarray(nodes)[:, None] + np.arange(3)
