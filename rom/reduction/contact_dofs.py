"""Contact dofs of a sector: displacements of contact nodes, averages over patches, or a mortar projection."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.errors import RomParameterError
from rom.finite_elements.discretisation import discretise
from rom.reduction.mortar_dofs import Grid, contact_grid, mortar_projections
from rom.reduction.patch_dofs import patch_averages

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from geometry import SectorMesh

_ON_NODE = 1e-6  # a contact node this near to a node of the mesh, over the size of the face, is that node
CONTACT_DOFS = ("mortar", "patch", "nodal")


@dataclass(frozen=True)
class ContactDofs:
    """Contact dofs of both faces, the n_c of the right face first, on n mesh nodes."""

    # (2 n_c, n), W: the displacement u_k = sum_j W_kj u_j that a contact node stands for; each row sums to 1
    weights: csr_matrix
    frames: NDArray[np.float64]  # (2 n_c, 3, 3), contact frames, rows t1, t2, n
    position: NDArray[np.float64]  # (n_c, 3), positions of the right contact nodes, m
    area: NDArray[np.float64]  # (n_c,), areas that they stand for, m^2
    kind: str  # kind of contact dofs

    @property
    def count(self) -> int:
        """Contact nodes on a face."""
        return len(self.position)

    @property
    def motion(self) -> csr_matrix:
        """Contact dofs (6 n_c, 3n), t1, t2, n of each contact node, of mesh displacements."""
        from scipy.sparse import block_diag, identity, kron

        return (block_diag(self.frames) @ kron(self.weights, identity(3))).tocsr()


def nodal_dofs(sector: SectorMesh, vertex_node: NDArray[np.int64], n_nodes: int) -> ContactDofs:
    """Displacements of the contact nodes themselves; `vertex_node` (V,): node of each mesh vertex.

    Raises RomParameterError where the contact nodes are not nodes of the mesh on both faces.
    """
    from scipy.sparse import csr_matrix

    size = float(np.sqrt(sector.right.area.sum()))
    for face in (sector.right, sector.left):
        if np.abs(sector.points[face.nodes] - face.position).max() > _ON_NODE * size:
            allowed = 'needs faces whose meshes match, and a contact grid on their nodes; "mortar" and "patch" do not'
            raise RomParameterError("rom", "contact_dofs", "nodal", allowed)

    nodes = vertex_node[np.concatenate([sector.right.nodes, sector.left.nodes])]
    weights = csr_matrix((np.ones(len(nodes)), (np.arange(len(nodes)), nodes)), shape=(len(nodes), n_nodes))
    return ContactDofs(weights, _node_frames(sector), sector.right.position, sector.right.area, "nodal")


def averaged_dofs(sector: SectorMesh, element: str | None, kind: str, grid: Grid | None = None) -> ContactDofs:
    """Contact dofs of the kinds "patch" and "mortar"; `grid`: of the mortar, None for that of the contact nodes.

    Raises RomParameterError where the mesh does not have them.
    """
    nodes = discretise(sector, element)
    if kind == "patch":
        weights = patch_averages(nodes, sector)
        centroids = weights[: len(sector.right.position)] @ nodes.positions
        return ContactDofs(weights, _node_frames(sector), centroids, sector.right.area, kind)
    weights, frames, shares = mortar_projections(nodes, sector, grid or contact_grid(sector.right))
    position = weights[: len(shares)] @ nodes.positions
    return ContactDofs(weights, frames, position, shares * float(sector.right.area.sum()), kind)


def contact_areas(sector: SectorMesh, kind: str) -> NDArray[np.float64]:
    """Areas (n_c,) in m^2 that the contact nodes of a kind of contact dofs stand for.

    Parameters
    ----------
    sector : SectorMesh
        The mesh.
    kind : {"mortar", "patch", "nodal"}
        Kind of contact dofs.

    Returns
    -------
    (n_c,) array
        Areas, m^2; their sum is the area of the face.

    Raises
    ------
    RomParameterError
        The mesh does not have these contact dofs.

    Examples
    --------
    The areas of the Gauss points add up to contact length times thickness of the shroud, 1 cm^2:

    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
    >>> from rom import contact_areas
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> sector = build_sector(blade, shroud, MeshParameters(size=0.02, contact_grid=(3, 2)))
    >>> areas = contact_areas(sector, "mortar")
    >>> len(areas), round(1e4 * float(areas.sum()), 6)
    (6, 1.0)
    """
    if kind != "mortar":
        return sector.right.area
    straight = all(block.kind == "hex8" for block in sector.blocks)
    return averaged_dofs(sector, "hex8" if straight else None, kind).area


def _node_frames(sector: SectorMesh) -> NDArray[np.float64]:
    return np.concatenate([sector.right.frame, sector.left.frame])
