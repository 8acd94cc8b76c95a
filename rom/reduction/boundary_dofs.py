"""Boundary dofs of a reduced model: contact nodes, tip and loaded node, and the frames of their displacements."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.errors import RomParameterError
from rom.finite_elements.full_model import FullModel, node_dofs
from rom.reduction.averaged_variables import averaged_variables
from rom.reduction.contact_dofs import CONTACT_DOFS, ContactDofs, averaged_dofs, nodal_dofs
from rom.reduction.interface_motion import InterfaceMotion
from rom.reduction.load_vectors import LoadVectors

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from geometry import SectorMesh


@dataclass(frozen=True)
class BoundaryChoice:
    """Choice of the boundary dofs: where the blade is excited, and what the contact dofs are.

    Attributes
    ----------
    excitation_direction : (3,) sequence of float
        Direction of the excitation, of any length.
    excitation_at : "tip" or (3,) sequence of float
        Where it acts: at the tip, or at the mesh vertex nearest to a position in m.
    contact_dofs : {"mortar", "patch", "nodal"}
        What the contact dofs are: the displacement of the face projected on polynomials, with the contact nodes at
        its Gauss points; averages over the part of the face that each contact node of the mesh stands for; or the
        displacements of these nodes.
    mortar_grid : (int, int), optional
        Gauss points of the mortar along t1 and along the radius, by default as many as the mesh has contact nodes.
    loads : callable, optional
        Further loads and outputs, as a function of the full model.
    interface : InterfaceMotion, optional
        Cut faces that join the sector to its neighbours, see `interface_motion`.

    Raises
    ------
    RomParameterError
        A value is not one of those allowed.

    Examples
    --------
    >>> from rom import BoundaryChoice
    >>> BoundaryChoice(excitation_direction=(3.0, 4.0, 0.0)).unit_direction.tolist()
    [0.6, 0.8, 0.0]
    """

    excitation_direction: ArrayLike = (0.0, 1.0, 0.0)
    excitation_at: str | ArrayLike = "tip"
    contact_dofs: str = "mortar"
    mortar_grid: tuple[int, int] | None = None
    loads: Callable[[FullModel], LoadVectors] | None = None
    interface: InterfaceMotion | None = None

    def __post_init__(self) -> None:
        direction, at = np.asarray(self.excitation_direction, dtype=float), self.excitation_at
        if direction.shape != (3,) or not np.all(np.isfinite(direction)) or not np.any(direction):
            raise RomParameterError(
                "excitation", "direction", self.excitation_direction, "must be three finite numbers, not all 0"
            )
        if isinstance(at, str):
            if at != "tip":
                raise RomParameterError("excitation", "at", at, 'must be "tip" or a position [x, y, z] in metres')
        elif np.shape(at) != (3,) or not np.all(np.isfinite(np.asarray(at, dtype=float))):
            raise RomParameterError(
                "excitation", "at", at, 'must be "tip" or a position [x, y, z] of finite numbers in metres'
            )
        if self.contact_dofs not in CONTACT_DOFS:
            allowed = f"must be one of {', '.join(CONTACT_DOFS)}"
            raise RomParameterError("rom", "contact_dofs", self.contact_dofs, allowed)

    @property
    def unit_direction(self) -> NDArray[np.float64]:
        """Direction of the excitation, (3,), of length 1."""
        vector = np.asarray(self.excitation_direction, dtype=float)
        return vector / np.linalg.norm(vector)


AT_TIP = BoundaryChoice()


@dataclass(frozen=True)
class BoundaryDofs:
    """Boundary nodes in the order of the reduced coordinates: right and left contact, tip, loaded node, interface."""

    # (k,), the boundary nodes. With averaged contact dofs the first ones stand for the averages
    nodes: NDArray[np.int64]
    # (f, 3, 3), rows: the directions of the coordinates of each of the first f nodes, t1, t2, n for contact nodes and
    # x, y, z for the others; q = frame @ u. The nodes behind them are those of the interface, without it f = k
    frames: NDArray[np.float64]
    contact: ContactDofs  # the contact dofs
    tip: int  # positions of the tip and of the loaded node in `nodes`
    loaded: int  # positions of the tip and of the loaded node in `nodes`
    direction: NDArray[np.float64]  # (3,), direction of the excitation, of length 1
    # (n, n), T of the mesh displacements u = T z of n nodes, the same for x, y and z; z holds the averaged contact
    # dofs in the places of as many nodes, the first boundary nodes. None: z = u, the contact dofs are nodal
    variables: csr_matrix | None = None
    # motions of the last boundary nodes, which have fewer coordinates than dofs
    interface: InterfaceMotion | None = None

    @property
    def n_contacts(self) -> int:
        """Number of contact nodes on a face."""
        return self.contact.count

    @property
    def size(self) -> int:
        """Number of boundary dofs b."""
        return 3 * len(self.frames) + (0 if self.interface is None else self.interface.size)

    @property
    def dofs(self) -> NDArray[np.int64]:
        """Boundary dofs of the mesh (3k,): x, y, z of each node."""
        return node_dofs(self.nodes).ravel()

    @property
    def rotation(self) -> NDArray[np.float64]:
        """Block-diagonal matrix (b, 3k) of orthonormal rows with q = rotation @ u."""
        rotation = np.zeros((self.size, 3 * len(self.nodes)))
        for k, frame in enumerate(self.frames):
            rotation[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = frame
        if self.interface is not None:
            first = 3 * len(self.frames)
            rotation[first:, first:] = self.interface.rows
        return rotation

    def node_displacement(self, k: int) -> NDArray[np.float64]:
        """Displacement x, y, z of boundary node k, not of the interface, from the boundary dofs q, (3, b)."""
        rows = np.zeros((3, self.size))
        rows[:, 3 * k : 3 * k + 3] = self.frames[k].T
        return rows

    def motion(self, n_nodes: int) -> csr_matrix:
        """Boundary dofs q without the interface, (3f, 3n), of mesh displacements."""
        from scipy.sparse import csr_matrix, vstack

        held = node_dofs(self.nodes[2 * self.n_contacts : len(self.frames)]).ravel()
        others = csr_matrix((np.ones(len(held)), (np.arange(len(held)), held)), shape=(len(held), 3 * n_nodes))
        return vstack([self.contact.motion, others], format="csr")

    def transform_force(self, force: NDArray[Any]) -> NDArray[Any]:
        """Forces T^T f (N,) on the variables z of nodal forces (N,)."""
        return force if self.variables is None else (self.variables.T @ force.reshape(-1, 3)).ravel()

    def mesh_displacements(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Mesh displacements T z (N, k) of values (N, k) of the variables z, in their place: few rows differ."""
        if self.variables is not None:
            replaced = self.nodes[: 2 * self.n_contacts]
            nodal = values.reshape(len(values) // 3, -1)
            nodal[replaced] = self.variables[replaced] @ nodal
        return values


def choose_boundary_dofs(full: FullModel, sector: SectorMesh, choice: BoundaryChoice) -> BoundaryDofs:
    """Boundary dofs of a sector: contact dofs in the contact frame, the tip and the loaded node.

    A tip or loaded node that is a boundary node already is not added again. Raises RomParameterError when a boundary
    node is clamped, and when the mesh does not have the contact dofs.
    """
    tip = int(full.vertex_node[sector.node_sets["tip"][0]])
    loaded = tip if isinstance(choice.excitation_at, str) else _nearest_vertex(full, choice.excitation_at)
    joined = np.zeros(0, dtype=np.int64) if choice.interface is None else choice.interface.nodes
    contact, held, variables = _contact_nodes(full, sector, np.array([tip, loaded, *joined]), choice)
    nodes = [int(node) for node in held]
    frames = [*contact.frames]
    for node in (tip, loaded):
        if node not in nodes:
            nodes.append(node)
            frames.append(np.eye(3))
    boundary = np.array(nodes, dtype=np.int64)
    clamped = np.isin(3 * boundary, full.fixed)
    if clamped.any():
        where = full.positions[boundary[clamped][0]].tolist()
        raise RomParameterError("excitation", "at", where, "this node lies on the clamped root; load a node off it")
    if np.isin(boundary, joined).any():
        where = full.positions[boundary[np.isin(boundary, joined)][0]].tolist()
        allowed = "must not be a node of contact, of load or the tip: it lies on a cut face joined to the neighbour"
        raise RomParameterError("mesh", "cyclic_right", where, allowed)
    return BoundaryDofs(
        nodes=np.concatenate([boundary, joined]),
        frames=np.array(frames),
        contact=contact,
        tip=nodes.index(tip),
        loaded=nodes.index(loaded),
        direction=choice.unit_direction,
        variables=variables,
        interface=choice.interface,
    )


def _contact_nodes(
    full: FullModel, sector: SectorMesh, others: NDArray[np.int64], choice: BoundaryChoice
) -> tuple[ContactDofs, NDArray[np.int64], csr_matrix | None]:
    """Contact dofs, the nodes (2 n_c,) that they stand at, and T for averages; `others`: other boundary nodes."""
    if choice.contact_dofs == "nodal":
        contact = nodal_dofs(sector, full.vertex_node, len(full.positions))
        return contact, contact.weights.indices.astype(np.int64), None
    contact = averaged_dofs(sector, full.element, choice.contact_dofs, choice.mortar_grid)
    reserved = np.union1d(others, full.fixed // 3)
    return contact, *averaged_variables(contact.weights, reserved, choice.contact_dofs)


def _nearest_vertex(full: FullModel, position: ArrayLike) -> int:
    """Node of the mesh vertex nearest to a position (3,) in m."""
    vertices = full.positions[full.vertex_node]
    return int(full.vertex_node[np.argmin(np.sum((vertices - np.asarray(position, dtype=float)) ** 2, axis=1))])
