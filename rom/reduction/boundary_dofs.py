"""Which dofs a reduced model keeps, and the frame in which it keeps them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.errors import RomParameterError
from rom.finite_elements.discretisation import discretise
from rom.finite_elements.full_model import FullModel, node_dofs
from rom.reduction.averaged_variables import averaged_variables
from rom.reduction.patch_dofs import patch_averages

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from geometry import SectorMesh

CONTACT_DOFS = ("nodal", "patch")


@dataclass(frozen=True)
class BoundaryDofs:
    """Kept nodes in the order of the reduced coordinates: right contact, left contact, tip, loaded node.

    nodes (k,); frames (k, 3, 3): rows are the directions whose displacements are the coordinates (t1, t2, n for
    contact nodes, x, y, z for the others), so q = frame @ u at each node; n_contacts per face; tip and loaded:
    positions in `nodes`. variables (N, N): T with mesh displacements u = T z, where z holds the averages over the
    contact patches in the places of as many nodes, the first ones of `nodes`; None: z = u, contact dofs are nodal.
    """

    nodes: NDArray[np.int64]
    frames: NDArray[np.float64]
    n_contacts: int
    tip: int
    loaded: int
    variables: csr_matrix | None = None

    @property
    def size(self) -> int:
        """Number of kept dofs."""
        return 3 * len(self.nodes)

    @property
    def dofs(self) -> NDArray[np.int64]:
        """Kept mesh dofs (3k,), x, y, z of each node."""
        return node_dofs(self.nodes).ravel()

    @property
    def rotation(self) -> NDArray[np.float64]:
        """Block-diagonal (3k, 3k) with q = rotation @ u."""
        rotation = np.zeros((self.size, self.size))
        for k, frame in enumerate(self.frames):
            rotation[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = frame
        return rotation

    def displacement(self, k: int, n: int) -> NDArray[np.float64]:
        """Rows (3, n): x, y, z displacement of kept node k from n reduced coordinates."""
        rows = np.zeros((3, n))
        rows[:, 3 * k : 3 * k + 3] = self.frames[k].T
        return rows

    def quadratic_form(self, matrix: csr_matrix) -> csr_matrix:
        """A matrix (N, N) of the mesh displacements in the variables z: T^T A T."""
        return matrix if self.variables is None else (self.variables.T @ matrix @ self.variables).tocsr()

    def forces(self, force: NDArray[np.float64]) -> NDArray[np.float64]:
        """Forces (N,) on the variables z of nodal forces (N,): T^T f."""
        return force if self.variables is None else self.variables.T @ force

    def displacements(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Mesh displacements (N, k) of values (N, k) of the variables z: T z."""
        return values if self.variables is None else self.variables @ values


def choose_boundary_dofs(
    full: FullModel, sector: SectorMesh, excitation_at: str | ArrayLike, contact_dofs: str = "nodal"
) -> BoundaryDofs:
    """Contact dofs in the contact frame, the tip, and the node nearest to `excitation_at`: "tip" or (3,) metres.

    contact_dofs: "nodal", the displacements of the contact nodes, or "patch", the averages over their patches of the
    face. A tip or loaded node that is already kept is not kept twice. Raises RomParameterError when a node to keep
    is clamped and where there are no such contact dofs.
    """
    tip = int(full.vertex_node[sector.node_sets["tip"][0]])
    loaded = tip if isinstance(excitation_at, str) else _nearest_vertex(full, excitation_at)
    if isinstance(excitation_at, str) and excitation_at != "tip":
        raise RomParameterError("excitation", "at", excitation_at, 'must be "tip" or a position [x, y, z] in metres')
    contact, variables = _contact_nodes(full, sector, np.array([tip, loaded]), contact_dofs)
    nodes = [int(node) for node in contact]
    frames = [*sector.right.frame, *sector.left.frame]
    for node in (tip, loaded):
        if node not in nodes:
            nodes.append(node)
            frames.append(np.eye(3))
    kept = np.array(nodes, dtype=np.int64)
    clamped = np.isin(3 * kept, full.fixed)
    if clamped.any():
        where = full.positions[kept[clamped][0]].tolist()
        raise RomParameterError("excitation", "at", where, "this node lies on the clamped root; load a node off it")
    return BoundaryDofs(
        kept, np.array(frames), len(sector.right.nodes), nodes.index(tip), nodes.index(loaded), variables
    )


def _contact_nodes(
    full: FullModel, sector: SectorMesh, taken: NDArray[np.int64], contact_dofs: str
) -> tuple[NDArray[np.int64], csr_matrix | None]:
    """Nodes (2 n_c,) in whose places the contact dofs stand, right ones first, and T where they are averages."""
    require_contact_dofs(contact_dofs)
    if contact_dofs == "nodal":
        return full.vertex_node[np.concatenate([sector.right.nodes, sector.left.nodes])], None
    discretisation = discretise(sector.points, sector.hexahedra, full.element)
    return averaged_variables(patch_averages(discretisation, sector), taken)


def require_contact_dofs(value: Any) -> None:
    """Raise RomParameterError for a kind of contact dofs that there is not."""
    if value not in CONTACT_DOFS:
        raise RomParameterError("rom", "contact_dofs", value, f"must be one of {', '.join(CONTACT_DOFS)}")


def _nearest_vertex(full: FullModel, position: ArrayLike) -> int:
    """Node of the mesh vertex nearest to a position (3,) in metres."""
    point = np.asarray(position, dtype=float)
    if point.shape != (3,) or not np.all(np.isfinite(point)):
        raise RomParameterError(
            "excitation", "at", position, 'must be "tip" or a position [x, y, z] of finite numbers in metres'
        )
    vertices = full.positions[full.vertex_node]
    return int(full.vertex_node[np.argmin(np.sum((vertices - point) ** 2, axis=1))])
