"""Contact dofs of a sector: displacements of contact nodes, averages over patches, or a mortar projection.

With patches every contact node stands for a part of the face: the points of the face that are nearer to it than to
any other contact node. On the meshes of `geometry` the patches are equal parts of the face. The average over patch k
is

    u_k = int_patch u dA / int_patch dA = sum_j W_kj u_j,       W_kj = int_patch N_j dA / int_patch dA,

with the shape functions N_j of the mesh nodes j. The force that does work with u_k is a uniform traction on the
patch: W^T spreads it over the nodes with the same resultant and the same moment about the patch's centroid W x.
Springs at n equal patches along an edge lose 1/n^2 of the rotational stiffness of the face.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from geometry.sector import interface_of
from rom.errors import RomParameterError
from rom.finite_elements.discretisation import Discretisation, discretise
from rom.reduction.face_integrals import FacePoints, Rule, face_points, opposite_points, sides_of, with_points_at
from rom.reduction.mortar_dofs import Grid, contact_grid, face_coordinates, mortar_projections

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from geometry.sector import SectorMesh
    from rom.cyclic.reduced_model import ReducedModel

# Between two grid nodes the mesh has equal steps, so a patch ends on an edge or on the middle line of an element:
# with the points of a quarter of an element on one side of it the integrals are exact.
_QUARTER = 3  # Gauss points a direction: exact for quadratic shape functions on a bilinear face
_NORMALISED = 1e-12
_ON_NODE = 1e-6  # a contact node this near to a node of the mesh, over the size of the face, is that node
_IN_LINE = 1e-9  # of the size of a face: nodes nearer than this to a line stand in it
CONTACT_DOFS = ("mortar", "patch", "nodal")


def patch_averages(discretisation: Discretisation, sector: SectorMesh) -> csr_matrix:
    """W (m, n) of the patches of the right, then of the left face, from n mesh nodes; each row sums to 1.

    On faces whose meshes differ the left patches get linear weights with the centroids of the right patches turned
    back by one pitch.
    Raises RomParameterError where the mesh has no node sets of the faces, or a contact node has no patch on its face.
    """
    from scipy.sparse import vstack

    rows: list[csr_matrix] = []
    for side, face in sides_of(sector):
        points = face_points(discretisation, sector, side, "patch", _halves())
        owner = _owner(points, face.position)
        average = _averages(points, owner, len(face.position))
        if rows:
            targets = opposite_points(rows[0] @ discretisation.positions, sector)
            average = with_points_at(average, targets, discretisation.positions, points, owner)
        rows.append(average)
    return vstack(rows, format="csr")


def _owner(points: FacePoints, centres: NDArray[np.float64]) -> NDArray[np.int64]:
    """The contact node (q,) that each quadrature point is nearest to, of those at `centres` (n_c, 3) in m."""
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(centres).query(points.position)[1], dtype=np.int64)


def _averages(points: FacePoints, owner: NDArray[np.int64], count: int) -> csr_matrix:
    """W (n_c, n) of one face with `count` contact nodes."""
    from scipy.sparse import csr_matrix

    area = np.bincount(owner, points.area, count)
    if not np.all(area > _NORMALISED * area.max(initial=0.0)):
        node = int(np.argmin(area))
        raise RomParameterError("rom", "contact_dofs", "patch", f"needs a face around contact node {node}")
    share = csr_matrix((points.area / area[owner], (owner, np.arange(len(owner)))), shape=(count, len(owner)))
    return (share @ points.interpolation).tocsr()


def _halves() -> Rule:
    """Gauss points (p,) and weights (p,) of the two halves of [0, 1]."""
    point, weight = np.polynomial.legendre.leggauss(_QUARTER)
    return np.concatenate([0.25 + 0.25 * point, 0.75 + 0.25 * point]), np.concatenate([weight, weight]) / 4.0


@dataclass(frozen=True)
class ContactDofs:
    """Contact dofs of both faces, the n_c of the right face first, on n mesh nodes.

    Against the ground there is no left face: m = 2 n_c without such interfaces.
    """

    # (m, n), W: the displacement u_k = sum_j W_kj u_j that a contact node stands for; each row sums to 1
    weights: csr_matrix
    frames: NDArray[np.float64]  # (m, 3, 3), contact frames, rows t1, t2, n
    position: NDArray[np.float64]  # (n_c, 3), positions of the right contact nodes, m
    area: NDArray[np.float64]  # (n_c,), areas that they stand for, m^2
    kind: str  # kind of contact dofs
    interfaces: Mapping[str, int]  # contact interfaces by name, with their numbers of contact nodes
    kinds: Mapping[str, str]  # of these interfaces, as of `geometry.FacePair`

    @property
    def count(self) -> int:
        """Contact nodes on a face."""
        return len(self.position)

    @property
    def sides(self) -> int:
        """Contact nodes m of both faces."""
        return len(self.frames)

    def relative(self, motion: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any] | None]:
        """The parts of the relative displacement (3 n_c, k) without and with the factor -exp(i psi) of the wave.

        motion (3 m, k): displacements of the contact dofs. None where no interface is between neighbours.
        """
        right, left = motion[: 3 * self.count], np.zeros_like(motion[: 3 * self.count])
        first, at = 0, 3 * self.count
        for name, count in self.interfaces.items():
            rows, first = slice(first, first + 3 * count), first + 3 * count
            if self.kinds[name] == "ground":
                continue
            other, at = motion[at : at + 3 * count], at + 3 * count
            if self.kinds[name] == "inside":
                right = np.concatenate([right[: rows.start], right[rows] - other, right[rows.stop :]])
            else:
                left[rows] = other
        return right, left if "neighbours" in self.kinds.values() else None

    @property
    def motion(self) -> csr_matrix:
        """Contact dofs (6 n_c, 3n), t1, t2, n of each contact node, of mesh displacements."""
        from scipy.sparse import block_diag, identity, kron

        return (block_diag(self.frames) @ kron(self.weights, identity(3))).tocsr()

    def flexibility(self, of_dofs: NDArray[Any]) -> NDArray[Any]:
        """That of both parts of the relative displacement, one behind the other, from that of the dofs (3 m, 3 m)."""
        parts = self.relative(np.eye(3 * self.sides))
        rows = np.concatenate([part for part in parts if part is not None])
        return np.asarray(rows @ of_dofs @ rows.T)


def joined_dofs(parts: Sequence[ContactDofs]) -> ContactDofs:
    """Contact dofs of several pairs of faces as those of one pair: all right faces first, by the order of parts."""
    from scipy.sparse import vstack

    first, *others = parts
    if not others:
        return first
    sides = [(slice(None, part.count), slice(part.count, None)) for part in parts]
    chosen = [(part, rows[k]) for k in (0, 1) for part, rows in zip(parts, sides, strict=True)]
    interfaces: dict[str, int] = {}
    for name, count in (item for part in parts for item in part.interfaces.items()):
        interfaces[name] = interfaces.get(name, 0) + count
    return ContactDofs(
        vstack([part.weights[rows] for part, rows in chosen], format="csr"),
        np.concatenate([part.frames[rows] for part, rows in chosen]),
        np.concatenate([part.position for part in parts]),
        np.concatenate([part.area for part in parts]),
        first.kind,
        interfaces,
        {name: kind for part in parts for name, kind in part.kinds.items()},
    )


def nodal_dofs(sector: SectorMesh, vertex_node: NDArray[np.int64], n_nodes: int) -> ContactDofs:
    """Displacements of the contact nodes of all pairs themselves; `vertex_node` (V,): node of each mesh vertex.

    Raises RomParameterError where the contact nodes are not nodes of the mesh on both faces.
    """
    from scipy.sparse import csr_matrix

    if sector.pairs:
        return joined_dofs([nodal_dofs(view, vertex_node, n_nodes) for view in sector.views.values()])
    size = float(np.sqrt(sector.right.area.sum()))
    faces = [face for _, face in sides_of(sector)]
    for face in faces:
        if np.abs(sector.points[face.nodes] - face.position).max() > _ON_NODE * size:
            allowed = 'needs faces whose meshes match, and a contact grid on their nodes; "mortar" and "patch" do not'
            raise RomParameterError("rom", "contact_dofs", "nodal", allowed)

    nodes = vertex_node[np.concatenate([face.nodes for face in faces])]
    weights = csr_matrix((np.ones(len(nodes)), (np.arange(len(nodes)), nodes)), shape=(len(nodes), n_nodes))
    named = _named(sector, len(sector.right.nodes))
    return ContactDofs(weights, _node_frames(sector), sector.right.position, sector.right.area, "nodal", *named)


def _named(view: SectorMesh, count: int) -> tuple[dict[str, int], dict[str, str]]:
    """Number of contact nodes and kind of the interface of one pair of faces, by its name."""
    name = interface_of(view.main)
    return {name: count}, {name: view.kind}


def averaged_dofs(sector: SectorMesh, element: str | None, kind: str, grid: Grid | None = None) -> ContactDofs:
    """Contact dofs of all pairs of faces, of the kinds "patch" and "mortar".

    `grid`: of the mortar, None for that of the contact nodes of each pair.

    Raises RomParameterError where the mesh does not have them.
    """
    if sector.pairs:
        return joined_dofs([averaged_dofs(view, element, kind, grid) for view in sector.views.values()])
    nodes = discretise(sector, element)
    if kind == "patch":
        weights = patch_averages(nodes, sector)
        centroids = weights[: len(sector.right.position)] @ nodes.positions
        named = _named(sector, len(centroids))
        return ContactDofs(weights, _node_frames(sector), centroids, sector.right.area, kind, *named)
    grid = grid or contact_grid(sector.right.position, sector.right.frame)
    weights, frames, shares = mortar_projections(nodes, sector, grid)
    position = weights[: len(shares)] @ nodes.positions
    areas = shares * float(sector.right.area.sum())
    return ContactDofs(weights, frames, position, areas, kind, *_named(sector, len(position)))


@dataclass(frozen=True)
class ContactNodes:
    """Where the contact nodes of all interfaces are, in the order of the interfaces."""

    interfaces: Mapping[str, int]  # interfaces by name with their numbers of nodes
    position: NDArray[np.float64]  # (n_c, 3) positions of the right nodes, m
    area: NDArray[np.float64] | None = None  # (n_c,) areas that they stand for, m^2; None: not known
    frame: NDArray[np.float64] | None = None  # (n_c, 3, 3) directions t1, t2, n, in rows; None: not known

    @classmethod
    def of(cls, model: ReducedModel) -> ContactNodes:
        """Those of a reduced model."""
        return cls(model.interfaces, model.contact_position, model.contact_area, model.contact_frame)

    def split(self) -> Mapping[str, ContactNodes]:
        """The nodes of each interface by its name."""
        found, first = {}, 0
        for name, count in self.interfaces.items():
            own = slice(first, first + count)
            area, frame = (None if array is None else array[own] for array in (self.area, self.frame))
            found[name] = ContactNodes({name: count}, self.position[own], area, frame)
            first += count
        return found

    @property
    def coordinates(self) -> NDArray[np.float64]:
        """Coordinates x along t1 and y along t2, (2, n_c), of the nodes of one interface.

        Over the face they have the mean 0 and the mean square 1/3: on a rectangle they run from -1 to 1. One in which
        all nodes stand in a line is 0. With a mortar of two points or more in a direction they are exact.
        """
        assert self.frame is not None
        found = np.stack(face_coordinates(self.position, self.frame, self.position))
        share = self.shares
        found = found - (found @ share)[:, None]
        size = np.sqrt(3.0 * (found**2 @ share))
        return np.where(size[:, None] > _IN_LINE * size.max(), found / np.maximum(size, 1e-300)[:, None], 0.0)

    @property
    def shares(self) -> NDArray[np.float64]:
        """Shares (n_c,) of the nodes in the area, the same for all where it is not known."""
        area = np.ones(len(self.position)) if self.area is None else self.area
        return np.asarray(area / area.sum())


def contact_nodes(sector: SectorMesh, kind: str) -> ContactNodes:
    """Contact nodes of a sector with a kind of contact dofs.

    Returns positions, frames and areas, which add up to those of the faces.
    """
    if kind == "nodal":
        faces = [view.right for view in sector.views.values()]
        position, area, frame = (
            np.concatenate([getattr(face, name) for face in faces]) for name in ("position", "area", "frame")
        )
        return ContactNodes(sector.interfaces, position, area, frame)
    straight = all(block.kind == "hex8" for block in sector.blocks)
    dofs = averaged_dofs(sector, "hex8" if straight else None, kind)
    return ContactNodes(dofs.interfaces, dofs.position, dofs.area, dofs.frames[: dofs.count])


def _node_frames(sector: SectorMesh) -> NDArray[np.float64]:
    return np.concatenate([face.frame for _, face in sides_of(sector)])
