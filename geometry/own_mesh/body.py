"""The body that the elements make: its boundary, whether it is one piece, and whether elements are inside out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from geometry.elements import ElementBlock, ElementSides, IntArray, sides_on
from geometry.errors import OwnMeshError
from geometry.imported_mesh import ImportedMesh
from geometry.own_mesh.side_quadrature import quadrature, side_tables
from geometry.sector import FloatArray


def checked_body(mesh: ImportedMesh) -> tuple[ImportedMesh, list[str]]:
    """The mesh without the nodes that no element uses, and what was left out.

    Raises OwnMeshError where there are no elements, two separate bodies, or elements turned inside out.
    """
    if mesh.n_elements == 0:
        raise OwnMeshError("mesh.file", mesh.path, "must hold solid elements; there are none")
    if not np.isfinite(mesh.points).all():
        raise OwnMeshError("mesh.file", mesh.path, "holds a node that is not finite")
    used = np.unique(np.concatenate([block.nodes.ravel() for block in mesh.blocks]))
    mesh, notes = _without_unused(mesh, used)
    _check_one_piece(mesh)
    return mesh, notes


def boundary(blocks: tuple[ElementBlock, ...]) -> ElementSides:
    """The sides that belong to one element only."""
    everything = sides_on(blocks, np.unique(np.concatenate([block.nodes.ravel() for block in blocks])))
    keys = np.full((len(everything), 4), -1, dtype=np.int64)
    for index, block in enumerate(blocks):
        for side, corners in enumerate(block.topology.sides):
            here = np.flatnonzero((everything.block == index) & (everything.side == side))
            keys[here, : len(corners)] = np.sort(block.nodes[everything.element[here]][:, list(corners)], axis=1)
    _, first, count = np.unique(keys, axis=0, return_index=True, return_counts=True)
    return chosen_sides(everything, np.sort(first[count == 1]))


def chosen_sides(surface: ElementSides, rows: IntArray) -> ElementSides:
    """Some sides of a surface."""
    return ElementSides(surface.block[rows], surface.element[rows], surface.side[rows])


def side_corners(blocks: tuple[ElementBlock, ...], surface: ElementSides) -> IntArray:
    """Corners (s, 4) of each side of a surface; of a triangle the last one twice."""
    corners = np.empty((len(surface), 4), dtype=np.int64)
    for index, block in enumerate(blocks):
        for side, local in enumerate(block.topology.sides):
            here = np.flatnonzero((surface.block == index) & (surface.side == side))
            corners[here] = block.nodes[surface.element[here]][:, list(local) + [local[-1]] * (4 - len(local))]
    return corners


def check_orientation(path: str, points: FloatArray, blocks: tuple[ElementBlock, ...], outside: ElementSides) -> None:
    """Raise OwnMeshError where the volume inside the boundary is not positive: a mirrored mesh."""
    surface = quadrature(points, side_tables(blocks, outside))
    volume = (
        float(np.sum(surface.area * np.sum(surface.normal * (surface.position - surface.centroid), axis=1))) / 3.0
    )
    if not volume > 0.0:
        told = f"its elements are turned inside out (volume {volume:.3g} m^3), as those of a mirrored mesh are"
        raise OwnMeshError("mesh.file", path, f"{told}; renumber the nodes of the elements")


def pieces(n_nodes: int, tables: list[IntArray]) -> IntArray:
    """Number of the connected piece (n,) that each node belongs to; tables (s, m) of nodes that hang together."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    start = np.concatenate([np.repeat(table[:, 0], table.shape[1] - 1) for table in tables])
    end = np.concatenate([table[:, 1:].ravel() for table in tables])
    graph = coo_matrix((np.ones(len(start), dtype=np.int8), (start, end)), shape=(n_nodes, n_nodes))
    return np.asarray(connected_components(graph, directed=False)[1])


def _without_unused(mesh: ImportedMesh, used: IntArray) -> tuple[ImportedMesh, list[str]]:
    left_out = len(mesh.points) - len(used)
    if left_out == 0:
        return mesh, []
    place = np.full(len(mesh.points), -1, dtype=np.int64)
    place[used] = np.arange(len(used))
    node_sets = {name: place[nodes][place[nodes] >= 0] for name, nodes in mesh.node_sets.items()}
    emptied = [name for name, nodes in node_sets.items() if len(nodes) == 0 and len(mesh.node_sets[name]) > 0]
    blocks = tuple(replace(block, nodes=place[block.nodes]) for block in mesh.blocks)
    cut = replace(
        mesh, points=mesh.points[used], node_labels=mesh.node_labels[used], blocks=blocks, node_sets=node_sets
    )
    notes = [f"{left_out} nodes belong to no element and are left out"]
    return cut, notes + [f'node set "{name}" has no node of an element' for name in emptied]


def _check_one_piece(mesh: ImportedMesh) -> None:
    """Raise OwnMeshError where the elements are not one connected body."""
    part = pieces(len(mesh.points), [block.nodes for block in mesh.blocks])
    if part.max() == 0:
        return
    owner = np.concatenate([part[block.nodes[:, 0]] for block in mesh.blocks])
    count = np.sort(np.bincount(owner))[::-1]
    named = ", ".join(str(number) for number in count[:4]) + (", ..." if len(count) > 4 else "")
    told = f"must be one connected body; there are {len(count)}, of {named} elements: merge the nodes between them"
    raise OwnMeshError("mesh.file", mesh.path, told)
