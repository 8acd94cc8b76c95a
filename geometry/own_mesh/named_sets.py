"""Node sets and surfaces of a file by the names that a user gives."""

from __future__ import annotations

import difflib
from collections.abc import Mapping

import numpy as np

from geometry.elements import ElementBlock, ElementSides, IntArray, sides_on
from geometry.errors import OwnMeshError
from geometry.imported_mesh import ImportedMesh
from geometry.own_mesh.body import chosen_sides

_MOST_NAMES = 8  # listed in a message


def names_of_file(mesh: ImportedMesh, sets: Mapping[str, str]) -> tuple[dict[str, str], list[str]]:
    """Names of sets by role as the file writes them, where only upper and lower case differ; and notes on them."""
    known = {*mesh.node_sets, *mesh.surfaces}
    found, notes = dict(sets), []
    for role, name in sets.items():
        alike = sorted(each for each in known if each.lower() == name.lower())
        if name not in known and len(alike) == 1:
            found[role] = alike[0]
            notes.append(f'mesh.sets.{role}: "{name}" is "{alike[0]}" in the file')
    return found, notes


def look_up(mesh: ImportedMesh, role: str, name: str) -> ElementSides | IntArray:
    """The surface, or else the nodes, of a name; OwnMeshError where there is none or it is empty."""
    key = f"mesh.sets.{role}"
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
    rows = np.flatnonzero(np.isin(_codes(mesh.blocks, outside), _codes(mesh.blocks, given)))
    if len(rows) == 0:
        what = "side" if isinstance(found, ElementSides) else "set of nodes"
        count = len(given) if isinstance(found, ElementSides) else len(found)
        told = f"{count} {what}s inside the body" if len(given) else f"a {what} ({count}) with no whole element side"
        raise OwnMeshError(
            f"mesh.sets.{role}", name, f"must hold whole sides of elements on the surface; it is {told}"
        )
    return chosen_sides(outside, rows)


def nodes_with_mid_sides(mesh: ImportedMesh, role: str, name: str, outside: ElementSides) -> IntArray:
    """Nodes of a set or surface, and the mid-side nodes of the sides of the boundary between its nodes."""
    found = look_up(mesh, role, name)
    nodes = found.nodes(mesh.blocks) if isinstance(found, ElementSides) else np.unique(found)
    between = sides_on(mesh.blocks, nodes)
    rows = np.flatnonzero(np.isin(_codes(mesh.blocks, outside), _codes(mesh.blocks, between)))
    return np.union1d(nodes, chosen_sides(outside, rows).nodes(mesh.blocks))


def _codes(blocks: tuple[ElementBlock, ...], surface: ElementSides) -> IntArray:
    """A number (s,) for each side of each element."""
    most = max(len(block) for block in blocks)
    return np.asarray((surface.block * most + surface.element) * 8 + surface.side)


def _near(name: str, known: list[str]) -> str:
    lowered = {each.lower(): each for each in known}
    near = [lowered[each] for each in difflib.get_close_matches(name.lower(), lowered, n=2, cutoff=0.5)]
    if near:
        return f"; near: {', '.join(near)}"
    return f"; it has {', '.join(known[:_MOST_NAMES])}{', ...' if len(known) > _MOST_NAMES else ''}"
