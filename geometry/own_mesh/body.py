"""The body that the elements make: boundary, connectedness, orientation, and its sets and surfaces by name."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from geometry.elements import ElementBlock, ElementSides, IntArray, sides_on
from geometry.errors import OwnMeshError
from geometry.imported_mesh import ImportedMesh
from geometry.own_mesh.side_quadrature import quadrature, side_tables
from geometry.sector import FloatArray

_MOST_NAMES = 8  # listed in a message


def checked_body(mesh: ImportedMesh, several: bool = False) -> tuple[ImportedMesh, list[str]]:
    """The mesh without the nodes that no element uses, and what was left out.

    Raises OwnMeshError where there are no elements, `several` bodies unasked for, or elements turned inside out.
    """
    if mesh.n_elements == 0:
        raise OwnMeshError("mesh.file", mesh.path, "must hold solid elements; there are none")
    if not np.isfinite(mesh.points).all():
        raise OwnMeshError("mesh.file", mesh.path, "holds a node that is not finite")
    used = np.unique(np.concatenate([block.nodes.ravel() for block in mesh.blocks]))
    mesh, notes = _without_unused(mesh, used)
    if not several:
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
    heat = None if mesh.temperature is None else mesh.temperature[used]
    cut = replace(mesh, points=mesh.points[used], node_labels=mesh.node_labels[used], temperature=heat)
    cut = replace(cut, blocks=blocks, node_sets=node_sets)
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
    told = f"must be one connected body; there are {len(count)}, of {named} elements: merge the nodes between them, "
    told += "or name the faces at which they touch in [mesh.interface.NAME]"
    raise OwnMeshError("mesh.file", mesh.path, told)


def names_of_file(mesh: ImportedMesh, sets: Mapping[str, str]) -> tuple[dict[str, str], list[str]]:
    """Names of sets by role as the file writes them, where only upper and lower case differ; and notes on them.

    Here and below a role is one of `SETS`, or the dotted key of a set.
    """
    known = {*mesh.node_sets, *mesh.surfaces}
    found, notes = dict(sets), []
    for role, name in sets.items():
        alike = sorted(each for each in known if each.lower() == name.lower())
        if name not in known and len(alike) == 1:
            found[role] = alike[0]
            notes.append(f'{key_of(role)}: "{name}" is "{alike[0]}" in the file')
    return found, notes


def key_of(role: str) -> str:
    """Dotted key in the scene of the set with a role."""
    return role if "." in role else f"mesh.sets.{role}"


def look_up(mesh: ImportedMesh, role: str, name: str) -> ElementSides | IntArray:
    """The surface, or else the nodes, of a name; OwnMeshError where there is none or it is empty."""
    key = key_of(role)
    if name in mesh.surfaces and len(mesh.surfaces[name]):
        return mesh.surfaces[name]
    if name in mesh.node_sets:
        if len(mesh.node_sets[name]) == 0:
            raise OwnMeshError(key, name, "this set has no node of an element")
        return mesh.node_sets[name]
    if name in mesh.element_sets:
        raise OwnMeshError(key, name, "is a set of elements; must be a node set or a surface")
    known = sorted({*mesh.node_sets, *mesh.surfaces})
    if not known:
        raise OwnMeshError(key, name, "the file has no node sets and no surfaces")
    raise OwnMeshError(key, name, f"the file has no such set{_near(name, known)}")


def face_sides(mesh: ImportedMesh, role: str, name: str, outside: ElementSides) -> ElementSides:
    """The sides of the boundary in a set or surface of the file; OwnMeshError where there are none."""
    found = look_up(mesh, role, name)
    given = found if isinstance(found, ElementSides) else sides_on(mesh.blocks, found)
    rows = np.flatnonzero(np.isin(side_codes(mesh.blocks, outside), side_codes(mesh.blocks, given)))
    if len(rows) == 0:
        what = "element face" if isinstance(found, ElementSides) else "set of nodes"
        count = len(given) if isinstance(found, ElementSides) else len(found)
        told = f"{count} {what}s inside the body" if len(given) else f"a {what} ({count}) with no whole element face"
        raise OwnMeshError(key_of(role), name, f"must hold whole element faces on the surface; it is {told}")
    return chosen_sides(outside, rows)


def nodes_with_mid_sides(mesh: ImportedMesh, role: str, name: str, outside: ElementSides) -> IntArray:
    """Nodes of a set or surface, and the mid-side nodes of the sides of the boundary between its nodes."""
    found = look_up(mesh, role, name)
    nodes = found.nodes(mesh.blocks) if isinstance(found, ElementSides) else np.unique(found)
    between = sides_on(mesh.blocks, nodes)
    rows = np.flatnonzero(np.isin(side_codes(mesh.blocks, outside), side_codes(mesh.blocks, between)))
    return np.union1d(nodes, chosen_sides(outside, rows).nodes(mesh.blocks))


def side_codes(blocks: tuple[ElementBlock, ...], surface: ElementSides) -> IntArray:
    """A number (s,) for each side of each element."""
    most = max(len(block) for block in blocks)
    return np.asarray((surface.block * most + surface.element) * 8 + surface.side)


def _near(name: str, known: list[str]) -> str:
    lowered = {each.lower(): each for each in known}
    near = [lowered[each] for each in difflib.get_close_matches(name.lower(), lowered, n=2, cutoff=0.5)]
    if near:
        return f"; near: {', '.join(near)}"
    return f"; it has {', '.join(known[:_MOST_NAMES])}{', ...' if len(known) > _MOST_NAMES else ''}"
