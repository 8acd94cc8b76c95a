"""From labels to rows: nodes, elements, sets and surfaces of a mesh file looked up and checked.

Collapsed elements, hexahedra and wedges that repeat nodes, are taken for the wedge or tetrahedron that they are.
Ansys writes the prism and tetrahedral forms of SOLID185 and SOLID186 in this way, Nastran and Abaqus users do it by
hand. The corners of an element of which edges are collapsed are grouped; each side keeps its distinct corners, and
the solid that these sides enclose is recognised by their number: three quadrilaterals and two triangles are a wedge,
four triangles a tetrahedron, one quadrilateral and four triangles a pyramid, which is refused.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from geometry.elements import ELEMENT_KINDS, ElementBlock, ElementKind, ElementSides
from geometry.imported_mesh import ImportedMesh
from geometry.mesh_files.file_mesh import MOST_SETS, NO_LABELS, ONLY, FileElements, FileMesh, counted, listed
from geometry.mesh_files.match_faces import sides_with_corners
from geometry.sector import FloatArray, IntArray

GONE = -1
MOST_NOTES = 40
_FLAT = 1e-14  # of the cube of its size: a volume that is round-off


@dataclass(frozen=True)
class WholeElements:
    """Elements of one kind whose nodes are all distinct."""

    kind: str  # name in `ELEMENT_KINDS`
    # `labels`, `nodes`: (E,), labels of elements and nodes
    labels: IntArray
    nodes: IntArray
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


def imported_mesh(mesh: FileMesh) -> ImportedMesh:
    """The mesh with its labels looked up."""
    _make_printable(mesh)
    _check_counts(mesh)
    labels, points = _distinct_nodes(mesh)
    wholes = [whole for elements in mesh.elements for whole in whole_elements(mesh, elements)]
    _check_element_labels(mesh, wholes)
    used = np.unique(np.concatenate([whole.nodes.ravel() for whole in wholes]))
    unknown = used[~np.isin(used, labels, assume_unique=True)]
    if len(unknown):
        owner = next(whole for whole in wholes if unknown[0] in whole.nodes)
        label = owner.labels[(owner.nodes == unknown[0]).any(axis=1)][0]
        raise mesh.refuse(
            f"element {label} ({owner.kind}) names node {unknown[0]}, which is not defined "
            f"({counted(len(unknown), 'such node')}): all nodes must be in the file"
        )
    rows = np.searchsorted(labels, used)
    if len(used) < len(labels):
        mesh.notes.append(f"{counted(len(labels) - len(used), 'node')} of no solid element left out")
    points, labels = np.ascontiguousarray(points[rows]), used
    parts = [_right_way_round(mesh, _with_rows(whole, labels), points) for whole in wholes]
    turned = sum(len(part.labels) for _, part in parts)
    if turned:
        mesh.notes.append(f"{counted(turned, 'element')} numbered the other way round, inside out: turned round")
    wholes = [part for pair in parts for part in pair if len(part.labels)]
    for whole in wholes:
        _check_mid_sides_in_place(mesh, whole, points)
    for kind in dict.fromkeys(whole.kind for whole in wholes):
        _check_doubles(mesh, kind, [whole for whole in wholes if whole.kind == kind])
    blocks, element_labels, side_maps = _blocks(mesh, wholes)
    _take_plane_elements(mesh, blocks, labels)
    finder = _ElementFinder(element_labels)
    collapsed = sum(len(whole.labels) for whole in wholes if whole.collapsed)
    if collapsed:
        are = "is taken as a wedge or a tetrahedron" if collapsed == 1 else "are taken as wedges or tetrahedra"
        mesh.notes.append(f"{counted(collapsed, 'collapsed element')} (repeated nodes) {are}")
    node_sets = _node_sets(mesh, labels)
    surfaces = _surfaces(mesh, finder, side_maps, blocks, labels)
    of_materials = [line for lines in mesh.material_notes.values() for line in lines]
    of_materials += [f"material {name} is {what}: {ONLY}" for name, what in mesh.unread_materials.items()]
    return ImportedMesh(
        mesh.path,
        points,
        labels,
        blocks,
        element_labels,
        node_sets,
        _element_sets(mesh, finder),
        surfaces,
        {name: dict(numbers) for name, numbers in mesh.materials.items()},
        _shortened([*of_materials, *mesh.notes]),
        _shortened(mesh.warnings),
        {name: tuple(lines) for name, lines in mesh.material_notes.items()},
        dict(mesh.unread_materials),
        mesh.units,
        mesh.root if mesh.root in node_sets else "",
        tuple(pair for pair in mesh.contacts if set(pair) <= node_sets.keys() | surfaces.keys()),
        np.array([mesh.temperatures.get(int(label), np.nan) for label in labels]) if mesh.temperatures else None,
    )


def _make_printable(mesh: FileMesh) -> None:
    """Names and lines without control characters, which a terminal would obey; different names stay different."""
    tables = ("node_sets", "element_sets", "sides", "faces", "materials", "material_notes", "unread_materials")
    known: dict[str, str] = {}
    for name in dict.fromkeys(name for table in tables for name in getattr(mesh, table)):
        plain = _printable(name)
        while plain in known.values():
            plain += "_"
        known[name] = plain
    if all(name == plain for name, plain in known.items()) and all(
        map(str.isprintable, [*mesh.notes, *mesh.warnings])
    ):
        return
    for table in tables:
        setattr(mesh, table, {known[name]: values for name, values in getattr(mesh, table).items()})
    mesh.element_material = [(labels, known.get(name, _printable(name))) for labels, name in mesh.element_material]
    mesh.root = known.get(mesh.root, "")
    mesh.contacts = [(known[one], known[other]) for one, other in mesh.contacts]
    mesh.notes, mesh.warnings = ([_printable(line) for line in lines] for lines in (mesh.notes, mesh.warnings))
    mesh.material_notes = {name: list(map(_printable, lines)) for name, lines in mesh.material_notes.items()}
    mesh.unread_materials = {name: _printable(what) for name, what in mesh.unread_materials.items()}


def _printable(text: str) -> str:
    return " ".join("".join(c if c.isprintable() else " " for c in text).split()) if not text.isprintable() else text


def _check_counts(mesh: FileMesh) -> None:
    mesh.elements = [elements for elements in mesh.elements if len(elements.labels)]
    if not len(mesh.node_labels):
        raise mesh.refuse("holds no nodes: a mesh of solid elements is needed")
    if not mesh.elements:
        mesh.leave_out("bodies", {elements.kind: len(elements.labels) for elements in mesh.plane if elements.kind})
        said = [*mesh.warnings, *mesh.notes]
        left_out = f" ({'; '.join(said[:3])}{' ...' * (len(said) > 3)})" if said else ""
        raise mesh.refuse(f"holds no solid elements{left_out}: allowed are tetrahedra, wedges and hexahedra")
    sets = len(mesh.node_sets) + len(mesh.element_sets) + len(mesh.sides) + len(mesh.faces)
    if sets > MOST_SETS:
        raise mesh.refuse(f"holds {sets} sets: at most {MOST_SETS} are read")


def _distinct_nodes(mesh: FileMesh) -> tuple[IntArray, FloatArray]:
    """Labels in ascending order with their points."""
    order = np.argsort(mesh.node_labels, kind="stable")
    labels, points = mesh.node_labels[order], mesh.points[order]
    wrong = ~np.isfinite(points).all(axis=1)
    if wrong.any():
        values = ", ".join(f"{x:g}" for x in points[wrong][0])
        raise mesh.refuse(
            f"node {labels[wrong][0]} is at ({values}) ({counted(int(wrong.sum()), 'such node')}): "
            "must be finite numbers"
        )
    again = np.flatnonzero(labels[1:] == labels[:-1]) + 1
    if not len(again):
        return labels, points
    moved = (points[again] != points[again - 1]).any(axis=1)
    if moved.any():
        raise mesh.refuse(
            f"node {labels[again][moved][0]} is defined twice at different places "
            f"({counted(int(moved.sum()), 'such node')}): each label must have one place"
        )
    mesh.notes.append(f"{counted(len(again), 'node')} defined twice at the same place")
    keep = np.ones(len(labels), dtype=bool)
    keep[again] = False
    return labels[keep], points[keep]


def _check_element_labels(mesh: FileMesh, wholes: list[WholeElements]) -> None:
    labels = np.sort(np.concatenate([whole.labels for whole in wholes]))
    again = labels[1:][labels[1:] == labels[:-1]]
    if len(again):
        raise mesh.refuse(
            f"element {again[0]} is defined twice ({counted(len(again), 'such element')}): "
            "each label must be of one element"
        )


def _check_doubles(mesh: FileMesh, kind: str, wholes: list[WholeElements]) -> None:
    """No two elements of a kind with the same corners."""
    count = ELEMENT_KINDS[kind].corners
    labels = np.concatenate([whole.labels for whole in wholes])
    corners = np.sort(np.concatenate([whole.nodes[:, :count] for whole in wholes]), axis=1)
    order = np.lexsort(corners.T)
    same = (corners[order[1:]] == corners[order[:-1]]).all(axis=1)
    if same.any():
        one, other = sorted(labels[order[np.flatnonzero(same)[0] + np.arange(2)]].tolist())
        raise mesh.refuse(
            f"elements {one} and {other} ({kind}) have the same corners "
            f"({counted(int(same.sum()), 'such pair')}): each must be there once"
        )


def _with_rows(whole: WholeElements, labels: IntArray) -> WholeElements:
    rows = np.searchsorted(labels, whole.nodes)
    return WholeElements(whole.kind, whole.labels, rows, whole.side_map, whole.collapsed)


def _right_way_round(mesh: FileMesh, whole: WholeElements, points: FloatArray) -> tuple[WholeElements, WholeElements]:
    """The elements with positive volumes, and those that are inside out, turned round; one without volume is refused.

    Programs differ in which way round the nodes go, and some take both. An element that is inside out is turned only
    where that makes it positive at each of its corners: another one has nodes in a wrong order.
    """
    kind = ELEMENT_KINDS[whole.kind]
    corners = points[whole.nodes[:, : kind.corners]]
    at_corners = corner_determinants(kind, corners)
    volume = at_corners.mean(axis=1)
    flat = np.abs(volume) <= _FLAT * np.ptp(corners, axis=1).max(axis=1) ** 3
    wrong = (volume < 0) & ~flat
    refused = flat | (wrong & (at_corners >= 0).any(axis=1))
    if refused.any():
        row = int(np.flatnonzero(refused)[0])
        what = (
            "has no volume" if flat[row] else "is inside out at some of its corners (its nodes are in a wrong order)"
        )
        raise mesh.refuse(
            f"element {whole.labels[row]} ({kind.name}) {what} ({counted(int(refused.sum()), 'such element')}): "
            "must have a positive volume"
        )
    columns, sides = mirrored(kind)
    return _part(whole, ~wrong), _part(whole, wrong, columns, sides[whole.side_map])


def _check_mid_sides_in_place(mesh: FileMesh, whole: WholeElements, points: FloatArray) -> None:
    """Refuse elements of which two mid-side nodes would fit the edges better if they were exchanged."""
    kind = ELEMENT_KINDS[whole.kind]
    if not kind.quadratic:
        return
    at = points[whole.nodes]
    middle, ends = at[:, kind.corners :], np.array(kind.edges)
    between = (at[:, ends[:, 0]] + at[:, ends[:, 1]]) / 2.0
    wrong = np.zeros(len(at), dtype=bool)
    for one, other in combinations(range(len(ends)), 2):
        moved, apart = middle[:, one] - middle[:, other], between[:, one] - between[:, other]
        wrong |= np.sum(moved * apart, axis=1) < 0.0
    if wrong.any():
        raise mesh.refuse(
            f"element {whole.labels[wrong][0]} ({kind.name}) has mid-side nodes that are not between their corners "
            f"({counted(int(wrong.sum()), 'such element')}): must be in the order of this format"
        )


def _part(
    whole: WholeElements, rows: IntArray, columns: list[int] | None = None, side_map: IntArray | None = None
) -> WholeElements:
    nodes = whole.nodes[rows] if columns is None else whole.nodes[rows][:, columns]
    sides = whole.side_map if side_map is None else side_map
    return WholeElements(whole.kind, whole.labels[rows], nodes, sides, whole.collapsed)


def corner_determinants(kind: ElementKind, corners: FloatArray) -> FloatArray:
    """Jacobian determinants at the corners (E, c), as if the edges were straight; their mean tells the volume.

    Shapes: `corners` (E, c, 3).
    """
    found = np.empty((len(corners), kind.corners))
    for corner in range(kind.corners):
        ends = _right_handed_neighbours(kind, corner)
        found[:, corner] = np.linalg.det(corners[:, ends] - corners[:, [corner]])
    return found


def _right_handed_neighbours(kind: ElementKind, corner: int) -> list[int]:
    """The three corners next to one, so that the edges to them have a positive triple product."""
    follows = {}
    for side in kind.sides:
        if corner in side:
            place = side.index(corner)
            follows[side[place - 1]] = side[(place + 1) % len(side)]
    first = min(follows)
    return [first, follows[first], follows[follows[first]]]


def mirrored(kind: ElementKind) -> tuple[list[int], IntArray]:
    """Columns of the nodes that turn an inside-out element round, and its sides by those of the file."""
    half = kind.corners // 2
    corners = [1, 0, 2, 3] if kind.corners == 4 else [*range(half, 2 * half), *range(half)]
    place = {frozenset(edge): kind.corners + k for k, edge in enumerate(kind.edges)}
    columns = corners + [place[frozenset(corners[c] for c in edge)] for edge in kind.edges if kind.quadratic]
    by_corners = {frozenset(corners[c] for c in side): k for k, side in enumerate(kind.sides)}
    sides = [by_corners[frozenset(side)] for side in kind.sides]
    return columns, np.array([*sides, GONE])  # the last entry answers GONE


def _blocks(
    mesh: FileMesh, wholes: list[WholeElements]
) -> tuple[tuple[ElementBlock, ...], tuple[IntArray, ...], list[IntArray]]:
    """Blocks by kind and material, their labels, and for each element the map of its sides (E, s)."""
    names = ["", *dict.fromkeys(name for _, name in mesh.element_material)]
    groups: dict[tuple[str, int], list[tuple[WholeElements, IntArray]]] = {}
    for whole in wholes:
        material = np.zeros(len(whole.labels), dtype=np.int64)
        for labels, name in mesh.element_material:
            material[np.isin(whole.labels, labels)] = names.index(name)
        for index in np.unique(material):
            groups.setdefault((whole.kind, int(index)), []).append((whole, np.flatnonzero(material == index)))
    blocks: list[ElementBlock] = []
    found: list[IntArray] = []
    maps: list[IntArray] = []
    for (kind, index), parts in groups.items():
        nodes = np.concatenate([whole.nodes[rows] for whole, rows in parts])
        blocks.append(ElementBlock(kind, np.ascontiguousarray(nodes), names[index]))
        found.append(np.concatenate([whole.labels[rows] for whole, rows in parts]))
        maps.append(np.concatenate([_side_table(whole, len(rows)) for whole, rows in parts]))
    return tuple(blocks), tuple(found), maps


def _side_table(whole: WholeElements, count: int) -> IntArray:
    table = np.full((count, 6), GONE)
    table[:, : len(whole.side_map)] = whole.side_map
    return table


class _ElementFinder:
    """Block and row of elements by label."""

    def __init__(self, labels: tuple[IntArray, ...]) -> None:
        everything = np.concatenate(labels)
        order = np.argsort(everything)
        self._labels = everything[order]
        self._block = np.repeat(np.arange(len(labels)), [len(part) for part in labels])[order]
        self._row = np.concatenate([np.arange(len(part)) for part in labels])[order]

    def find(self, labels: IntArray) -> tuple[IntArray, IntArray]:
        """Places (k, 2) of those labels that are solid elements, and which ones (k,) they are."""
        place = np.minimum(np.searchsorted(self._labels, labels), len(self._labels) - 1)
        known = np.flatnonzero(self._labels[place] == labels)
        place = place[known]
        return np.column_stack([self._block[place], self._row[place]]), known


def _node_sets(mesh: FileMesh, labels: IntArray) -> dict[str, IntArray]:
    found, empty = {}, []
    for name, members in mesh.node_sets.items():
        members = members[np.sort(np.unique(members, return_index=True)[1])] if len(members) else NO_LABELS
        place = np.minimum(np.searchsorted(labels, members), len(labels) - 1)
        rows = place[labels[place] == members]
        if len(rows):
            found[name] = rows
        else:
            empty.append(name)
        if 0 < len(rows) < len(members):
            mesh.notes.append(
                f"node set {name}: {len(members) - len(rows)} of {len(members)} nodes are of no solid element"
            )
    if empty:
        mesh.notes.append(f"node sets without a node of a solid element left out: {listed(empty)}")
    return found


def _element_sets(mesh: FileMesh, finder: _ElementFinder) -> dict[str, IntArray]:
    found, empty = {}, []
    for name, members in mesh.element_sets.items():
        places, _ = finder.find(np.unique(members))
        if len(places):
            found[name] = places
        else:
            empty.append(name)
    if empty:
        mesh.notes.append(f"element sets without solid elements left out: {listed(empty)}")
    return found


def _surfaces(
    mesh: FileMesh,
    finder: _ElementFinder,
    side_maps: list[IntArray],
    blocks: tuple[ElementBlock, ...],
    labels: IntArray,
) -> dict[str, ElementSides]:
    found = {}
    for name, sides in mesh.sides.items():
        places, known = finder.find(sides[:, 0])
        side = np.empty(len(known), dtype=np.int64)
        for index, table in enumerate(side_maps):
            here = places[:, 0] == index
            side[here] = table[places[here, 1], sides[known[here], 1]]
        left = side != GONE
        if not left.any():
            mesh.notes.append(f"surface {name} without a side of a solid element left out")
            continue
        found[name] = ElementSides(places[left, 0], places[left, 1], side[left])
    for name, groups in mesh.faces.items():
        rows = [np.searchsorted(labels, group[np.isin(group, labels).all(axis=1)]) for group in groups]
        surface = sides_with_corners(blocks, rows)
        total = sum(len(np.unique(np.sort(group, axis=1), axis=0)) for group in groups)
        if len(surface) < total:
            mesh.notes.append(
                f"surface {name}: {total - len(surface)} of {total} faces are sides of no solid element"
            )
        if len(surface):
            found[name] = surface
    return found


def _take_plane_elements(mesh: FileMesh, blocks: tuple[ElementBlock, ...], labels: IntArray) -> None:
    """Sets of plane elements as faces; what is no side of a solid, or has a thickness, is said to be left out."""
    if not mesh.plane:
        return
    members = np.concatenate([elements.labels for elements in mesh.plane])
    corners = np.concatenate([elements.nodes for elements in mesh.plane])
    for name, found in list(mesh.element_sets.items()):
        inside = np.isin(members, found)
        if inside.any():
            mesh.faces.setdefault(name, []).extend(_by_corners(corners[inside]))
            if inside.sum() == len(np.unique(found)):
                del mesh.element_sets[name]
    bare = ~np.isin(members, np.concatenate([NO_LABELS, *mesh.sections])) & _are_sides(corners, blocks, labels)
    ends = np.cumsum([0, *(len(elements.labels) for elements in mesh.plane)])
    counts: dict[bool, dict[str, int]] = {True: {}, False: {}}
    for elements, first, last in zip(mesh.plane, ends, ends[1:], strict=False):
        for on_solids in (True, False):
            if elements.kind and (number := int((bare[first:last] == on_solids).sum())):
                counts[on_solids][elements.kind] = counts[on_solids].get(elements.kind, 0) + number
    mesh.leave_out("bodies", counts[False])
    if counts[True]:
        names = listed([f"{number} {kind}" for kind, number in counts[True].items()], 8)
        mesh.notes.append(f"{names} on sides of solid elements: their sets are surfaces")


def _by_corners(corners: IntArray) -> list[IntArray]:
    """Faces (k, 3) and (m, 4) of corners (n, 4), two of which may be one node."""
    first = np.sort(corners, axis=1)
    three = (first[:, 1:] == first[:, :-1]).sum(axis=1) == 1
    four = (first[:, 1:] != first[:, :-1]).all(axis=1)
    triangles = np.array([list(dict.fromkeys(row)) for row in corners[three].tolist()], dtype=np.int64)
    return [triangles.reshape(-1, 3), corners[four]]


def _are_sides(corners: IntArray, blocks: tuple[ElementBlock, ...], labels: IntArray) -> NDArray[np.bool_]:
    """Which plane elements (n,) with labels of corners (n, 4) are sides of solids."""
    known = np.isin(corners, labels).all(axis=1)
    rows = np.searchsorted(labels, corners[known])
    sides = sides_with_corners(blocks, _by_corners(rows))
    solid = {
        tuple(sorted(blocks[block].nodes[element, list(blocks[block].topology.sides[side])].tolist()))
        for block, element, side in zip(sides.block, sides.element, sides.side, strict=True)
    }
    found = np.zeros(len(corners), dtype=bool)
    found[known] = [tuple(sorted(set(row))) in solid for row in rows.tolist()]
    return found


def _shortened(lines: list[str]) -> tuple[str, ...]:
    notes = list(dict.fromkeys(lines))
    if len(notes) > MOST_NOTES:
        notes = [*notes[:MOST_NOTES], f"and {len(notes) - MOST_NOTES} more"]
    return tuple(notes)
