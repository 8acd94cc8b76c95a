"""Boundary dofs of a reduced model: contact nodes, tip and loaded node; loads and outputs as vectors on the mesh.

Averages of the displacement are variables of the full model, each in the place of the displacement of one node. With
the averages W u among the variables the reduction needs no change: they are held, are coordinates and are loaded
like nodes. The condition W u = u_k is solved for as many nodes p as there are averages,
u_p = W_p^-1 (u_k - W_r u_r). This is a change of variables u = T z that is the identity but for the rows of those
nodes. The choice of the nodes changes the variables, not the model; with large shares W_p is well conditioned.

A force f on mesh displacements u = T q is the generalised force T^T f, an output o u is (T^T o)^T q. A force on the
interior bends the blade in a shape that a few fixed-interface modes do not have. Its static response with the
boundary dofs held, less the part that these modes have,

    a = K_ii^-1 f_i - sum over the modes of phi (phi^T f_i) / w^2,

is therefore kept as one more coordinate (MacNeal 1971; attachment modes of Craig and Chang 1977). The static response
to the loads, and that of the outputs to any load on the boundary or among them, is then that of the full model.

References
----------
R. H. MacNeal, A hybrid method of component mode synthesis, Computers & Structures 1 (1971) 581-601.
R. R. Craig, C.-J. Chang, On the use of attachment modes in substructure coupling for dynamic analysis,
18th Structures, Structural Dynamics and Materials Conference (1977), AIAA 77-405.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.errors import RomParameterError
from rom.finite_elements.discretisation import discretise
from rom.finite_elements.full_model import FullModel, node_dofs
from rom.linear_algebra.block_lanczos import orthonormal_combinations
from rom.reduction.contact_dofs import CONTACT_DOFS, ContactDofs, averaged_dofs, nodal_dofs
from rom.reduction.fixed_interface_modes import ModalBasis

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from geometry.sector import SectorMesh

_DEPENDENT = 1e-6
Vector = NDArray[Any]  # real or complex


def averaged_variables(
    averages: csr_matrix, reserved: NDArray[np.int64], kind: str
) -> tuple[NDArray[np.int64], csr_matrix]:
    """Nodes (k,) in whose places the averages W u stand, and T (n, n) with displacements u = T z, for x, y, z alike.

    z holds at those nodes the averages, elsewhere the displacement. W has the shape (k, n); the
    displacement of the `reserved` nodes stays a variable. Raises RomParameterError, about contact dofs of a `kind`,
    where the averages are linearly dependent on this mesh.
    """
    from scipy.linalg import qr
    from scipy.sparse import coo_matrix

    count, n = averages.shape
    candidates = np.setdiff1d(np.unique(averages.indices), reserved)
    triangle, order = qr(averages[:, candidates].toarray(), mode="r", pivoting=True)
    diagonal = np.abs(np.diag(triangle))
    if len(candidates) < count or diagonal.min() < _DEPENDENT * diagonal.max():
        allowed = "needs a finer mesh or fewer contact nodes: these averages depend on each other"
        raise RomParameterError("rom", "contact_dofs", kind, allowed)
    nodes = candidates[order[:count]]
    others = np.setdiff1d(np.unique(averages.indices), nodes)
    own = np.linalg.inv(averages[:, nodes].toarray())
    block = np.hstack([own, -own @ averages[:, others].toarray()])
    used, plain = np.concatenate([nodes, others]), np.setdiff1d(np.arange(n), nodes)
    rows = np.concatenate([plain, np.repeat(nodes, len(used))])
    columns = np.concatenate([plain, np.tile(used, count)])
    change = coo_matrix((np.concatenate([np.ones(len(plain)), block.ravel()]), (rows, columns)), shape=(n, n)).tocsr()
    change.eliminate_zeros()  # averages of one face do not depend on the other face
    return nodes, change


@dataclass(frozen=True)
class WaveReference:
    """Natural frequencies of the whole mesh at a nodal diameter."""

    nodal_diameter: int  # number of nodal diameters
    frequency_hz: NDArray[np.float64]  # (m,), the lowest frequencies, Hz, ascending
    sampled: bool  # whether the motions of the cut faces were taken from these modes too


@dataclass(frozen=True)
class InterfaceMotion:
    """Cut faces of a sector whose k nodes move in c given patterns."""

    nodes: NDArray[np.int64]  # (k,), nodes of the full model
    # (c, 3k), patterns, orthonormal: coordinates = rows @ u of the displacements u, u = rows^T @ coordinates
    rows: NDArray[np.float64]
    # (r, c), the same r motions of the right and of the left face from the coordinates, those of the left one turned
    # by one pitch: in a travelling wave the right ones are those of the left times exp(i psi)
    right: NDArray[np.float64]
    # (r, c), the same r motions of the right and of the left face from the coordinates, those of the left one turned
    # by one pitch: in a travelling wave the right ones are those of the left times exp(i psi)
    left: NDArray[np.float64]
    # frequencies of the whole mesh against which a reduction can be measured
    references: tuple[WaveReference, ...] = ()

    @property
    def size(self) -> int:
        """Number of coordinates c."""
        return len(self.rows)


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
    # `tip`, `loaded`: positions of the tip and of the loaded node in `nodes`
    tip: int
    loaded: int
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

        held = node_dofs(self.nodes[self.contact.sides : len(self.frames)]).ravel()
        others = csr_matrix((np.ones(len(held)), (np.arange(len(held)), held)), shape=(len(held), 3 * n_nodes))
        return vstack([self.contact.motion, others], format="csr")

    def transform_force(self, force: NDArray[Any]) -> NDArray[Any]:
        """Forces T^T f (N,) on the variables z of nodal forces (N,)."""
        return force if self.variables is None else (self.variables.T @ force.reshape(-1, 3)).ravel()

    def mesh_displacements(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Mesh displacements T z (N, k) of values (N, k) of the variables z, in their place: few rows differ."""
        if self.variables is not None:
            replaced = self.nodes[: self.contact.sides]
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


def check_reducible(sector: SectorMesh, choice: BoundaryChoice = AT_TIP) -> None:
    """Check, without matrices, that a sector has the contact dofs, loads and outputs that a reduction needs."""
    from scipy.sparse import csr_matrix

    nodes = discretise(sector)
    for _ in nodes.batches():
        pass
    size = 3 * nodes.n_nodes
    nothing, fixed = csr_matrix((size, size)), node_dofs(nodes.nodes_on(np.asarray(sector.node_sets["root"]))).ravel()
    bare = FullModel(nothing, nothing, nodes.positions, nodes.vertex_node, fixed, np.zeros(size), None)
    cuts = [sector.node_sets[name] for name in ("cyclic_right", "cyclic_left") if name in sector.node_sets]
    if cuts:
        joined = np.setdiff1d(nodes.vertex_node[np.concatenate(cuts)], fixed // 3)
        empty = np.zeros((0, 0))
        choice = replace(choice, interface=InterfaceMotion(joined, np.zeros((0, 3 * len(joined))), empty, empty))
    choose_boundary_dofs(bare, sector, choice)
    if choice.loads is not None:
        choice.loads(bare)


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


@dataclass(frozen=True)
class LoadVectors:
    """Forces and outputs on the N dofs of a full model.

    Attributes
    ----------
    excitation : mapping of int to (N,) array
        Forces of 1 N of excitation by harmonic of the excitation, N, real or complex. Harmonic 1 takes the place of
        the force at the loaded node, which acts where it is not given.
    static : (N,) array or None
        Static force, N.
    outputs : mapping of str to (N,) array
        Output NAME = outputs[NAME] @ u of the mesh displacements u.

    Examples
    --------
    A force on all nodes of a small model, and its mean displacement along y:

    >>> from rom import LoadVectors
    >>> along_y = np.tile([0.0, 1.0, 0.0], 4)
    >>> loads = LoadVectors(excitation={1: along_y}, outputs={"mean": along_y / 4})
    >>> loads.size, loads.static is None
    (12, True)
    """

    excitation: Mapping[int, Vector] = field(default_factory=dict)
    static: NDArray[np.float64] | None = None
    outputs: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)

    @property
    def size(self) -> int:
        """Number of dofs N of the vectors, 0 without any."""
        return next((len(vector) for _, vector in self.named()), 0)

    def named(self) -> Iterator[tuple[str, Vector]]:
        """All vectors with their names in a reduced model."""
        for h, vector in self.excitation.items():
            yield "force/excitation" if h == 1 else f"force/excitation_{h}", vector
        if self.static is not None:
            yield "force/static", self.static
        for name, vector in self.outputs.items():
            yield f"output/{name}", vector

    def columns(self) -> NDArray[np.float64]:
        """Real and imaginary parts of all vectors, where they are not zero, (N, k)."""
        parts = [part for _, vector in self.named() for part in (vector.real, vector.imag) if part.any()]
        return np.array(parts).reshape(len(parts), self.size).T

    def selection(self, given: dict[str, Any], projected: Callable[[Vector], Vector]) -> dict[str, Any]:
        """Forces and outputs of a reduced model, by argument of `ReducedModel`.

        Parameters
        ----------
        given : dict
            Those of the boundary dofs.
        projected : callable
            T^T f of a vector f.
        """
        values = dict(given)
        if 1 in self.excitation:
            values["force_excitation"] = projected(self.excitation[1])
        values["force_harmonics"] = {h: projected(vector) for h, vector in self.excitation.items() if h != 1}
        values["force_static"] = None if self.static is None else projected(self.static)
        values["outputs"] = given["outputs"] | {name: projected(row) for name, row in self.outputs.items()}
        return values


@dataclass(frozen=True)
class InteriorLoads:
    """Load vectors of a model that is partitioned at its boundary dofs."""

    vectors: LoadVectors  # the vectors on interior (3i) and boundary dofs (b), one behind the other
    # (3i, k), real and imaginary parts of their interior parts, where these are not zero
    columns: NDArray[np.float64]

    @classmethod
    def of(
        cls, loads: LoadVectors, boundary: BoundaryDofs, interior: NDArray[np.int64], n_dofs: int
    ) -> InteriorLoads:
        """Partition vectors on the mesh displacements. Raises RomParameterError for one of another length."""
        inner = node_dofs(interior).ravel()

        def partitioned(name: str, vector: Vector) -> Vector:
            if vector.shape != (n_dofs,) or not np.all(np.isfinite(vector)):
                raise RomParameterError("loads", name, vector.shape, f"must be {n_dofs} finite numbers, one a dof")
            on_variables = boundary.transform_force(vector)
            return np.concatenate([on_variables[inner], boundary.rotation @ on_variables[boundary.dofs]])

        found = {name: partitioned(name, vector) for name, vector in loads.named()}
        excitation = {h: found["force/excitation" if h == 1 else f"force/excitation_{h}"] for h in loads.excitation}
        outputs = {name: found[f"output/{name}"] for name in loads.outputs}
        vectors = LoadVectors(excitation, found.get("force/static"), outputs)
        columns = vectors.columns()[: len(inner)]
        return cls(vectors, columns[:, columns.any(axis=0)])

    def selection(
        self, given: dict[str, Any], constraint: NDArray[np.float64], shapes: NDArray[np.float64]
    ) -> dict[str, Any]:
        """Forces and outputs of a reduced model, by argument of `ReducedModel`; `given` those of the boundary dofs.

        constraint (3i, b), shapes (3i, m): the interior motion of the reduced coordinates.
        """

        def projected(vector: Vector) -> Vector:
            inner, held = vector[: len(shapes)], vector[len(shapes) :]
            return np.concatenate([constraint.T @ inner + held, shapes.T @ inner])

        return self.vectors.selection(given, projected)


def with_attachment_modes(
    modes: ModalBasis, columns: NDArray[np.float64], responses: NDArray[np.float64], mass: Any
) -> ModalBasis:
    """Fixed-interface modes and behind them combinations of the static responses to some forces.

    The added shapes are orthonormal to each other and to the modes in the mass, and orthogonal in the stiffness.
    Shapes: `columns` (3i, k), `responses` (3i, k), `mass` (3i, 3i).
    """
    if not columns.shape[1]:
        return modes
    rest, forces = responses, columns
    for _ in range(2):  # the rest may be small beside the part in the modes
        shares = modes.shapes.T @ (mass @ rest)
        rest = rest - modes.shapes @ shares
        forces = forces - mass @ (modes.shapes @ (modes.omega[:, None] ** 2 * shares))
    before = np.sum(responses * (mass @ responses), axis=0)
    chosen = orthonormal_combinations(rest.T @ (mass @ rest), before)
    rest, forces = rest @ chosen, forces @ chosen
    stiffness = rest.T @ forces
    squared, turn = np.linalg.eigh(0.5 * (stiffness + stiffness.T))
    return ModalBasis(
        np.concatenate([modes.omega, np.sqrt(np.maximum(squared, 0.0))]), np.hstack([modes.shapes, rest @ turn])
    )
