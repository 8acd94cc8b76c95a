"""Nodes, connectivity and shape functions of a mesh: its own isoparametric elements, or promoted hexahedra.

An isoparametric element takes the nodes of the mesh as they are, mid-side nodes on curved edges included. A mesh of
8-node hexahedra can be promoted to hex20 or hex27: the geometry stays straight-edged (trilinear), and scikit-fem
numbers the nodes.

Here stand too the quadrature points on sides of elements, flat or curved, and what makes a mesh a poor model.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from geometry.elements import ElementBlock, ElementSides
from rom.errors import RomParameterError
from rom.finite_elements.reference_element import ReferenceElement, ReferenceSide, ShapeTable, reference_sides

Array = NDArray[np.float64]
ELEMENTS = ("hex20", "hex8", "hex27")
# Corner k of scikit-fem's reference hexahedron is corner _VTK_CORNER[k] of VTK's and gmsh's.
_VTK_CORNER = (6, 2, 5, 7, 1, 3, 4, 0)
# Doubles in one batch of elements (about 64 MB).
_BATCH_DOUBLES = 8_000_000
Rule = tuple[Array, Array]
_BETTER = {"tet4": "tet10", "wedge6": "wedge15", "hex8": "hex20"}


class ElementMesh(Protocol):
    """What a discretisation needs of a mesh: a sector or a mesh from a file."""

    @property
    def points(self) -> Array:
        """Nodes (N, 3), m."""

    @property
    def blocks(self) -> tuple[ElementBlock, ...]:
        """Elements by kind and material."""


@dataclass(frozen=True)
class DiscreteBlock:
    """Elements of one kind and material: E elements of b nodes, their geometry given by g nodes."""

    reference: ReferenceElement  # the element on its reference cell
    nodes: NDArray[np.int64]  # (E, b), nodes of each element
    vertices: NDArray[np.int64]  # (E, g), rows of the points of the mesh that its geometry is given by
    geometry: Array  # (E, g, 3), their positions, m
    material: str  # name of the material
    table: ShapeTable  # shape functions at the quadrature points

    def __len__(self) -> int:
        return len(self.nodes)

    def jacobian(self, part: slice) -> tuple[Array, Array]:
        """Jacobian matrices (e, q, 3, 3) and determinants (e, q) of some elements at the quadrature points.

        Raises RomParameterError where a determinant is not above 0.
        """
        jacobian = np.einsum("eci,qcj->eqij", self.geometry[part], self.table.geometry_gradients, optimize=True)
        determinant = np.linalg.det(jacobian)
        if not determinant.min() > 0.0:
            worst = int(np.arange(len(self))[part][np.argmin(determinant.min(axis=1))])
            place = ", ".join(f"{x:.4g}" for x in self.geometry[worst].mean(axis=0))
            allowed = f"this element is turned inside out (Jacobian not above 0); it is at x, y, z = {place} m"
            raise RomParameterError("mesh", self.reference.kind, worst, allowed)
        return jacobian, determinant


class Batch(NamedTuple):
    """Some elements of one block."""

    nodes: NDArray[np.int64]  # (e, b), their nodes
    gradients: Array  # (e, q, 3, b), gradients of the shape functions at the quadrature points, 1/m
    weights: Array  # (e, q), weights of these points, m^3
    block: int  # block of the discretisation
    part: slice  # the elements in the block


@dataclass(frozen=True)
class Discretisation:
    """Nodes and shape functions for the integrals: n nodes on a mesh of V points."""

    positions: Array  # (n, 3), nodes, m
    vertex_node: NDArray[np.int64]  # (V,), node of each point of the mesh
    blocks: tuple[DiscreteBlock, ...]  # the elements, in the order of the blocks of the mesh

    @property
    def n_nodes(self) -> int:
        """Number of nodes, mid-side nodes included."""
        return len(self.positions)

    @property
    def n_gradients(self) -> int:
        """Components of all gradients at the quadrature points."""
        return sum(len(block) * block.table.gradients.size for block in self.blocks)

    def nodes_on(self, vertices: NDArray[np.integer[Any]]) -> NDArray[np.int64]:
        """Sorted nodes of some points of the mesh; of promoted elements the nodes between them too."""
        chosen = np.zeros(self.n_nodes, dtype=bool)
        chosen[self.vertex_node[vertices]] = True
        for block in self.blocks:
            if block.reference.promoted:
                geometry, _ = block.reference.geometry_functions(block.reference.nodes.T)
                support = geometry > 1e-12
                corner_chosen = chosen[block.nodes[:, support.sum(axis=1) == 1]]
                # A node belongs to the set when no corner that supports it is outside.
                inside = (~corner_chosen).astype(np.int64) @ support.T == 0
                chosen[block.nodes[inside]] = True
        return np.flatnonzero(chosen)

    def batches(self) -> Iterator[Batch]:
        """The elements in batches of bounded size, block by block.

        Raises RomParameterError when an element is turned inside out.
        """
        for index, block in enumerate(self.blocks):
            table = block.table
            n_elements, nodes = block.nodes.shape
            size = max(1, _BATCH_DOUBLES // (2 * (3 * nodes) ** 2))
            for first in range(0, n_elements, size):
                part = slice(first, min(first + size, n_elements))
                jacobian, determinant = block.jacobian(part)
                inverse_transposed = np.linalg.inv(jacobian).transpose(0, 1, 3, 2)
                gradients, weights = inverse_transposed @ table.gradients, determinant * table.weights
                yield Batch(block.nodes[part], gradients, weights, index, part)


def discretise(mesh: ElementMesh, element: str | None = None) -> Discretisation:
    """The nodes and shape functions of a mesh.

    With `element` None the elements are those of the mesh, isoparametric. "hex8", "hex20" and "hex27" promote a mesh
    of 8-node hexahedra.
    Raises RomParameterError for an unknown element, a mesh that cannot be promoted, or points that no element uses.
    """
    if element is not None and element not in ELEMENTS:
        raise RomParameterError("mesh", "element", element, f"must be one of {', '.join(ELEMENTS)}")
    used = np.zeros(len(mesh.points), dtype=bool)
    for block in mesh.blocks:
        used[block.nodes] = True
    if not used.all():
        raise RomParameterError("mesh", "points", int(np.argmin(used)), "this vertex belongs to no element")
    return _isoparametric(mesh) if element is None else _promoted(mesh, element)


def _isoparametric(mesh: ElementMesh) -> Discretisation:
    blocks = []
    for block in mesh.blocks:
        reference = ReferenceElement(block.kind, block.kind, promoted=False)
        nodes = np.asarray(block.nodes, dtype=np.int64)
        geometry = np.asarray(mesh.points)[nodes]
        blocks.append(DiscreteBlock(reference, nodes, nodes, geometry, block.material, reference.table()))
    return Discretisation(np.asarray(mesh.points), np.arange(len(mesh.points)), tuple(blocks))


def _promoted(mesh: ElementMesh, element: str) -> Discretisation:
    other = sorted({block.kind for block in mesh.blocks} - {"hex8"})
    if other:
        raise RomParameterError(
            "mesh", "element", element, f"must be None, left out in a scene: the mesh has {', '.join(other)} elements"
        )
    from skfem import Dofs, ElementHex1, ElementHex2, ElementHexS2, MeshHex1

    skfem_element = {"hex20": ElementHexS2, "hex8": ElementHex1, "hex27": ElementHex2}[element]()
    corners = np.concatenate([block.nodes for block in mesh.blocks])[:, _VTK_CORNER]
    skfem_mesh = MeshHex1(np.ascontiguousarray(mesh.points.T), np.ascontiguousarray(corners.T.astype(np.int32)))
    dofs = Dofs(skfem_mesh, skfem_element)
    reference = ReferenceElement(element, "hex8", promoted=True)
    geometry, _ = reference.geometry_functions(reference.nodes.T)
    corner_points = np.asarray(mesh.points)[corners]
    nodes = np.ascontiguousarray(dofs.element_dofs.T).astype(np.int64)
    positions = np.zeros((dofs.N, 3))
    positions[nodes] = np.einsum("bc,eci->ebi", geometry, corner_points)
    table, first = reference.table(), 0
    parts = []
    for block in mesh.blocks:
        part = slice(first, first + len(block))
        first += len(block)
        parts.append(DiscreteBlock(reference, nodes[part], corners[part], corner_points[part], block.material, table))
    return Discretisation(positions, dofs.nodal_dofs[0].astype(np.int64), tuple(parts))


@dataclass(frozen=True)
class SidePoints:
    """q quadrature points on the same side of s elements of one block."""

    position: Array  # (s, q, 3), points, m
    normal: Array  # (s, q, 3), outward normals, not of unit length: times the weights they are the area vectors, m^2
    weights: Array  # (q,), quadrature weights
    # (s, b), nodes of the elements, and rows of the points of the mesh that give their geometry
    nodes: NDArray[np.int64]
    # (s, b), nodes of the elements, and rows of the points of the mesh that give their geometry
    vertices: NDArray[np.int64]
    # `values`, `geometry`: (q, b), shape functions of the displacement and of the geometry
    values: Array
    geometry: Array

    @property
    def area(self) -> Array:
        """Shares (s, q) of the area, m^2."""
        return np.asarray(self.weights * np.linalg.norm(self.normal, axis=-1))


def points_on_sides(discretisation: Discretisation, sides: ElementSides, rule: Rule) -> Iterator[SidePoints]:
    """Quadrature points on a surface, one side of the reference cell after the other.

    The rule, points (p,) and weights (p,) on [0, 1], is applied in both directions of a quadrilateral. On a triangle
    it is applied to the square that is collapsed on it (Duffy): exact for one degree less.
    """
    for index, block in enumerate(discretisation.blocks):
        for side in reference_sides(block.reference.kind):
            elements = sides.element[(sides.block == index) & (sides.side == side.side)]
            if len(elements):
                yield _on_side(block, side, elements, rule)


def _on_side(block: DiscreteBlock, side: ReferenceSide, elements: NDArray[np.int64], rule: Rule) -> SidePoints:
    """Points on one side of the reference cell of some elements (s,)."""
    line, weight = rule
    x, y = (grid.ravel() for grid in np.meshgrid(line, line, indexing="ij"))
    weights = np.outer(weight, weight).ravel()
    if side.triangle:
        y, weights = y * (1.0 - x), weights * (1.0 - x)
    points = side.at(x, y)
    values, _ = block.reference.shape_functions(points)
    geometry, slopes = block.reference.geometry_functions(points)
    corners = block.geometry[elements]
    first, second = (np.einsum("qc,eci->eqi", slopes @ along, corners) for along in (side.u, side.v))
    return SidePoints(
        position=np.einsum("qc,eci->eqi", geometry, corners),
        normal=side.outward * np.cross(first, second),
        weights=weights,
        nodes=block.nodes[elements],
        vertices=block.vertices[elements],
        values=values,
        geometry=geometry,
    )


def element_warnings(mesh: ElementMesh) -> tuple[str, ...]:
    """Warnings about the elements of a mesh, taken as they are.

    Elements with linear shape functions bend far too stiffly. Elements are not connected along an edge where one has
    a mid-side node and the neighbour none, or another.

    Returns one line for each such kind of element, and one for hanging nodes; empty where there is none.
    """
    counts = {kind: sum(len(block) for block in mesh.blocks if block.kind == kind) for kind in _BETTER}
    lines = [
        f"{count} {kind} elements bend far too stiffly (linear shape functions): frequencies come out too high, "
        f"use {_BETTER[kind]}"
        for kind, count in counts.items()
        if count
    ]
    hanging = hanging_edges(mesh)
    if hanging:
        lines.append(
            f"{hanging} edges have a mid-side node in one element and none, or another one, in its neighbour: "
            "the elements are not connected there"
        )
    return tuple(lines)


def hanging_edges(mesh: ElementMesh) -> int:
    """Number of edges between two corners whose elements do not share one mid-side node, or have none."""
    if not any(block.topology.quadratic for block in mesh.blocks):
        return 0
    keys, middles = [], []
    for block in mesh.blocks:
        topology = block.topology
        ends = np.sort(block.nodes[:, np.array(topology.edges)], axis=-1).reshape(-1, 2)
        keys.append(ends[:, 0] * len(mesh.points) + ends[:, 1])
        middle = block.nodes[:, topology.corners :] if topology.quadratic else np.full((len(block), 1), -1)
        middles.append(np.broadcast_to(middle, (len(block), len(topology.edges))).ravel())
    pairs = np.unique(np.column_stack([np.concatenate(keys), np.concatenate(middles)]), axis=0)
    return len(pairs) - len(np.unique(pairs[:, 0]))
