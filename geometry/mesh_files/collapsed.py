"""Collapsed elements: hexahedra and wedges that repeat nodes, taken for the wedge or tetrahedron that they are.

Ansys writes the prism and tetrahedral forms of SOLID185 and SOLID186 in this way, Nastran and Abaqus users do it by
hand. The corners of an element of which edges are collapsed are grouped; each side keeps its distinct corners, and
the solid that these sides enclose is recognised by their number: three quadrilaterals and two triangles are a wedge,
four triangles a tetrahedron, one quadrilateral and four triangles a pyramid, which is refused.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geometry.elements import ELEMENT_KINDS, ElementKind
from geometry.mesh_files.file_mesh import FileElements, FileMesh, counted
from geometry.sector import IntArray

GONE = -1


@dataclass(frozen=True)
class WholeElements:
    """Elements of one kind whose nodes are all distinct."""

    kind: str  # name in `ELEMENT_KINDS`
    labels: IntArray  # (E,), labels of elements and nodes
    nodes: IntArray  # (E,), labels of elements and nodes
    side_map: IntArray  # (s,), for each side of the element of the file the side it is here; -1 where it has vanished
    collapsed: bool = False  # whether the file has another kind of element here


def whole_elements(mesh: FileMesh, elements: FileElements) -> list[WholeElements]:
    """Elements of a file as elements without repeated nodes."""
    kind = ELEMENT_KINDS[elements.kind]
    found: list[WholeElements] = []
    for part, topology in _linear_where_no_midside(mesh, elements, kind):
        corners = part.nodes[:, : topology.corners]
        first = (corners[:, :, None] == corners[:, None, :]).argmax(axis=2)
        patterns, which = np.unique(first, axis=0, return_inverse=True)
        for k, pattern in enumerate(patterns):
            rows = which.ravel() == k
            found.append(_of_pattern(mesh, topology, pattern.tolist(), part.labels[rows], part.nodes[rows]))
    return found


def _linear_where_no_midside(
    mesh: FileMesh, elements: FileElements, kind: ElementKind
) -> list[tuple[FileElements, ElementKind]]:
    absent = elements.nodes == 0
    if not absent.any():
        return [(elements, kind)]
    if absent[:, : kind.corners].any():
        label = elements.labels[absent[:, : kind.corners].any(axis=1)][0]
        raise mesh.refuse(f"element {label} ({kind.name}) has a corner without a node: give all {kind.corners}")
    ends = np.array(kind.edges)
    real = elements.nodes[:, ends[:, 0]] != elements.nodes[:, ends[:, 1]]  # edges that are not collapsed
    missing, count = (absent[:, kind.corners :] & real).sum(axis=1), real.sum(axis=1)
    partly = (missing > 0) & (missing < count)
    if partly.any():
        row = int(np.flatnonzero(partly)[0])
        raise mesh.refuse(
            f"element {elements.labels[row]} ({kind.name}) lacks {missing[row]} of its {count[row]} mid-side nodes: "
            f"give all {count[row]} or none ({counted(int(partly.sum()), 'such element')})"
        )
    bare = missing == count
    linear = next(k for k in ELEMENT_KINDS.values() if k.corners == kind.corners and not k.quadratic)
    mesh.notes.append(
        f"{int(bare.sum())} elements of {kind.name} have no mid-side nodes and are taken as {linear.name}"
    )
    parts = [
        (FileElements(linear.name, elements.labels[bare], elements.nodes[bare][:, : kind.corners]), linear),
        (FileElements(kind.name, elements.labels[~bare], elements.nodes[~bare]), kind),
    ]
    return [part for part in parts if len(part[0].labels)]


def _of_pattern(
    mesh: FileMesh, kind: ElementKind, pattern: list[int], labels: IntArray, nodes: IntArray
) -> WholeElements:
    """Elements with the same pattern: for each corner the first corner with its node."""
    if pattern == list(range(kind.corners)):
        whole = WholeElements(kind.name, labels, nodes, np.arange(len(kind.sides)))
        _check_midside(mesh, kind, whole)
        return whole
    sides = [_distinct([pattern[c] for c in side]) for side in kind.sides]
    polygons = [side for side in sides if len(side) > 2]
    shape = sorted(len(side) for side in polygons)
    corners = _wedge_corners(kind, pattern, polygons) if shape == [3, 3, 4, 4, 4] else None
    name = "wedge"
    if shape == [3, 3, 3, 3] and len(set(pattern)) == 4:
        a, b, c = polygons[0]
        corners, name = [a, c, b, next(k for k in pattern if k not in (a, b, c))], "tet"
    if corners is None:
        pyramid = shape == [3, 3, 3, 3, 4]
        what = "a pyramid" if pyramid else "no wedge and no tetrahedron"
        such = counted(len(labels), "such element")
        raise mesh.refuse(
            f"element {labels[0]} ({kind.name} with repeated nodes) is {what} ({such}): "
            "only tetrahedra, wedges and hexahedra are read; fill pyramids with tetrahedra"
        )
    new = next(k for k in ELEMENT_KINDS.values() if k.name.startswith(name) and k.quadratic == kind.quadratic)
    columns = corners + (_edge_columns(mesh, kind, new, pattern, corners, labels, nodes) if kind.quadratic else [])
    by_corners = {frozenset(corners[c] for c in side): k for k, side in enumerate(new.sides)}
    side_map = np.array([by_corners.get(frozenset(side), GONE) for side in sides])
    whole = WholeElements(new.name, labels, nodes[:, columns], side_map, True)
    _check_midside(mesh, new, whole)
    return whole


def _distinct(corners: list[int]) -> list[int]:
    return list(dict.fromkeys(corners))


def _wedge_corners(kind: ElementKind, pattern: list[int], polygons: list[list[int]]) -> list[int] | None:
    """Corners of a wedge in its node order: a triangle seen from inside, then those opposite."""
    a, b, c = next(side for side in polygons if len(side) == 3)
    base = [a, c, b]
    top = []
    for corner in base:
        ends = {
            pattern[other]
            for edge in kind.edges
            for one, other in (edge, edge[::-1])
            if pattern[one] == corner and pattern[other] not in base
        }
        if len(ends) != 1:
            return None
        top.append(ends.pop())
    return base + top if len(set(top)) == 3 else None


def _edge_columns(
    mesh: FileMesh,
    kind: ElementKind,
    new: ElementKind,
    pattern: list[int],
    corners: list[int],
    labels: IntArray,
    nodes: IntArray,
) -> list[int]:
    """Columns of `nodes` that hold the mid-side nodes of the new kind."""
    columns = []
    for edge in new.edges:
        ends = {corners[edge[0]], corners[edge[1]]}
        same = [kind.corners + k for k, e in enumerate(kind.edges) if {pattern[e[0]], pattern[e[1]]} == ends]
        differ = (nodes[:, same] != nodes[:, same[:1]]).any(axis=1)
        if differ.any():
            raise mesh.refuse(
                f"element {labels[differ][0]} ({kind.name} with repeated nodes) has two mid-side nodes on one edge: "
                "edges that fall together must share one"
            )
        columns.append(same[0])
    return columns


def _check_midside(mesh: FileMesh, kind: ElementKind, whole: WholeElements) -> None:
    """No node twice in an element."""
    ordered = np.sort(whole.nodes, axis=1)
    twice = (ordered[:, 1:] == ordered[:, :-1]).any(axis=1)
    if twice.any():
        found = "a repeated node" if not kind.quadratic else "a mid-side node that is another node too"
        raise mesh.refuse(f"element {whole.labels[twice][0]} ({kind.name}) has {found}: its nodes must be distinct")
