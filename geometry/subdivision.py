"""A finer mesh of a sector: each element is cut into 8 or 27 of its kind, with the geometry of its shape functions.

Nodes that are there keep their numbers. The new ones lie at mid-points in the natural coordinates of the elements.
Two elements that share a side have the same ones there, as a point is identified by its weights on the corners.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise, permutations, product

import numpy as np

from geometry.elements import ELEMENT_KINDS, ElementBlock, sides_on
from geometry.sector import FloatArray, IntArray, SectorMesh

POINTS = ("tip", "contact_right", "contact_left")  # sets that are no surfaces
_PARTS = (
    1728  # the weights of a point on the corners are whole multiples of one part: 64 = 4^3 and 216 = 6^3 divide it
)
_DIGITS = 12  # of natural coordinates: thirds are not exact
_TRIANGLE = ((0, 0), (1, 0), (0, 1))
_CORNERS = {
    4: ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)),
    6: (*((r, s, -1) for r, s in _TRIANGLE), *((r, s, 1) for r, s in _TRIANGLE)),
    8: tuple((r, s, t) for t in (-1, 1) for r, s in ((-1, -1), (1, -1), (1, 1), (-1, 1))),
}
_CHILD_TRIANGLES = (
    ((0.0, 0.0), (0.5, 0.0), (0.0, 0.5)),
    ((0.5, 0.0), (1.0, 0.0), (0.5, 0.5)),
    ((0.0, 0.5), (0.5, 0.5), (0.0, 1.0)),
    ((0.5, 0.5), (0.0, 0.5), (0.5, 0.0)),
)
_MIDDLES = {edge: k for k, edge in enumerate(ELEMENT_KINDS["tet10"].edges, start=4)}
# corners of the eight tetrahedra among the ten nodes of one: four at the corners, four around the diagonal 5-7
_CHILD_TETRAHEDRA = (
    *((0, 4, 6, 7), (4, 1, 5, 8), (6, 5, 2, 9), (7, 8, 9, 3)),
    *((7, 5, 4, 6), (7, 5, 8, 4), (7, 5, 9, 8), (7, 5, 6, 9)),
)


def subdivided(sector: SectorMesh, parts: int = 2) -> SectorMesh:
    """A mesh of the same sector with each edge in 2 or 3 parts: 8 or 27 elements in place of each.

    The points of the sector come first; node sets that are surfaces have the new nodes on them too. The contact
    nodes, their frames and areas stay.
    """
    cuts = [_cut(block.kind, parts) for block in sector.blocks]
    keys = [_keys(block, cut) for block, cut in zip(sector.blocks, cuts, strict=True)]
    width = max(key.shape[-1] for key in keys)
    flat = [np.pad(key.reshape(-1, key.shape[-1]), ((0, 0), (width - key.shape[-1], 0))) for key in keys]
    unique, first, place = np.unique(np.concatenate(flat), axis=0, return_index=True, return_inverse=True)
    number = _numbers(sector, cuts, place.ravel(), len(unique))
    found = np.concatenate(
        [_positions(sector.points, block, cut) for block, cut in zip(sector.blocks, cuts, strict=True)]
    )
    points = np.empty((number.max() + 1, 3))
    points[number] = found[first]
    points[: len(sector.points)] = sector.points
    nodes = _by_block(sector, cuts, number[place.ravel()])
    blocks = tuple(
        ElementBlock(block.kind, local[:, cut.children].reshape(-1, cut.children.shape[1]), block.material)
        for block, cut, local in zip(sector.blocks, cuts, nodes, strict=True)
    )
    sets = {
        name: members if name in POINTS else _finer_set(sector, nodes, cuts, members)
        for name, members in sector.node_sets.items()
    }
    surfaces = {
        name: sides_on(blocks, _finer_set(sector, nodes, cuts, sides.nodes(sector.blocks)))
        for name, sides in sector.surfaces.items()
    }
    pairs = {
        name: replace(pair, face_right=whole[0], face_left=whole[1])
        for name, pair in sector.pairs.items()
        if (whole := [_finer_set(sector, nodes, cuts, each) for each in (pair.face_right, pair.face_left)])
    }
    heat = None
    if sector.temperature is not None:  # as a coordinate
        column = np.repeat(sector.temperature[:, None], 3, axis=1)
        found = np.concatenate(
            [_positions(column, block, cut) for block, cut in zip(sector.blocks, cuts, strict=True)]
        )
        heat = np.empty(len(points))
        heat[number] = found[first, 0]
    finer = replace(sector, points=points, blocks=blocks, node_sets=sets, surfaces=surfaces, pairs=pairs)
    return replace(finer, temperature=heat)


@dataclass(frozen=True)
class _Cut:
    """How one element is cut."""

    weights: IntArray  # (p, c), weights of the points on the corners, in parts of `_PARTS`
    shapes: FloatArray  # (p, b), shape functions at the points
    children: IntArray  # (8 or 27, b), points of each new element
    nodes: IntArray  # (b,), the points that are the nodes of the element


@cache
def _cut(name: str, parts: int) -> _Cut:
    kind = ELEMENT_KINDS[name]
    corners = np.array(_CORNERS[kind.corners], dtype=float)
    children = _child_corners(kind.corners) if parts == 2 else _child_lattice(kind.corners, parts)
    if kind.quadratic:
        middles = [(children[:, a] + children[:, b]) / 2.0 for a, b in kind.edges]
        children = np.concatenate([children, np.stack(middles, axis=1)], axis=1)
        own = np.concatenate([corners, [(corners[a] + corners[b]) / 2.0 for a, b in kind.edges]])
    else:
        own = corners
    places, index = np.unique(children.reshape(-1, 3).round(_DIGITS), axis=0, return_inverse=True)
    nodes = np.array([int(np.flatnonzero((np.abs(places - node) < 1e-9).all(axis=1))[0]) for node in own])
    linear = _shapes(places, corners, kind.corners, quadratic=False)
    return _Cut(
        np.rint(_PARTS * linear).astype(np.int64),
        _shapes(places, own, kind.corners, quadratic=kind.quadratic),
        index.reshape(children.shape[:2]).astype(np.int64),
        nodes,
    )


def _child_corners(corners: int) -> FloatArray:
    """Natural coordinates (8, c, 3) of the corners of the eight parts."""
    if corners == 4:
        own = np.array(_CORNERS[4], dtype=float)
        nodes = np.concatenate([own, [(own[a] + own[b]) / 2.0 for a, b in _MIDDLES]])
        return np.asarray(nodes[np.array(_CHILD_TETRAHEDRA)])
    if corners == 6:
        layers = ((-1.0, 0.0), (0.0, 1.0))
        parts = [[(r, s, t) for t in ends for r, s in part] for ends in layers for part in _CHILD_TRIANGLES]
        return np.array(parts)
    own = np.array(_CORNERS[8], dtype=float)
    return (own[None, :, :] + own[:, None, :]) / 2.0


def _child_lattice(corners: int, parts: int) -> FloatArray:
    """Natural coordinates (parts^3, c, 3) of the corners of the parts, each edge cut into equal ones."""
    ends = np.linspace(-1.0, 1.0, parts + 1)
    if corners == 4:
        return _child_kuhn(parts)
    if corners == 6:
        step = 1.0 / parts
        triangles = [[(i, j), (i + 1, j), (i, j + 1)] for i in range(parts) for j in range(parts - i)]
        triangles += [[(i + 1, j), (i + 1, j + 1), (i, j + 1)] for i in range(parts) for j in range(parts - i - 1)]
        layers = pairwise(ends)
        return np.array(
            [[(i * step, j * step, t) for t in layer for i, j in tri] for layer in layers for tri in triangles]
        )
    own = np.array(_CORNERS[8], dtype=float)
    places = np.array([(r, s, t) for t in ends[:-1] for s in ends[:-1] for r in ends[:-1]])
    return np.asarray(places[:, None, :] + (own + 1.0)[None, :, :] / parts)


def _child_kuhn(parts: int) -> FloatArray:
    """The parts of a tetrahedron: of all cubes of a lattice, cut into six along their diagonal, those inside it.

    The tetrahedron is that of the points n >= x >= y >= z >= 0; its sides are cut alike from both elements.
    """
    found = []
    for cube in product(range(parts), repeat=3):
        for axes in permutations(range(3)):
            at = np.cumsum(np.vstack([cube, np.eye(3)[list(axes)]]), axis=0)
            if (np.diff(at, axis=1) <= 0.0).all():
                x, y, z = at.T
                found.append(np.stack([x - y, y - z, z], axis=1) / parts)
    children = np.array(found)
    turned = np.linalg.det(children[:, 1:] - children[:, :1]) < 0.0
    children[turned] = children[turned][:, [0, 2, 1, 3]]
    return children


def _shapes(places: FloatArray, nodes: FloatArray, corners: int, quadratic: bool) -> FloatArray:
    """Shape functions (p, b) of an element with its nodes (b, 3) at places (p, 3), all in natural coordinates."""
    return np.asarray(
        np.linalg.solve(_monomials(nodes, corners, quadratic).T, _monomials(places, corners, quadratic).T).T
    )


def _monomials(x: FloatArray, corners: int, quadratic: bool) -> FloatArray:
    """The monomials (p, b) that the shape functions of an element span, serendipity with mid-side nodes."""
    r, s, t = x.T
    one = np.ones_like(r)
    if corners == 4:
        terms = [one, r, s, t] + [r * r, s * s, t * t, r * s, s * t, t * r] * quadratic
    elif corners == 6:
        flat = [one, r, s]
        terms = [*flat, *(t * f for f in flat)]
        if quadratic:
            curved = [r * r, r * s, s * s]
            terms += [*curved, *(t * c for c in curved), t * t, t * t * r, t * t * s]
    else:
        terms = [one, r, s, t, r * s, s * t, t * r, r * s * t]
        if quadratic:
            squares = [r * r, s * s, t * t]
            others = ((s, t), (t, r), (r, s))
            terms += squares
            terms += [q * f for q, (a, b) in zip(squares, others, strict=True) for f in (a, b, a * b)]
    return np.stack(terms, axis=1)


def _keys(block: ElementBlock, cut: _Cut) -> IntArray:
    """What identifies each point (E, p, c): its corners with their weights, those without weight as 0, sorted."""
    corners = block.nodes[:, None, : block.topology.corners] + 1
    weighted: IntArray = np.where(cut.weights > 0, corners * (2 * _PARTS) + cut.weights, 0)
    return np.sort(weighted, axis=-1)


def _by_block(sector: SectorMesh, cuts: list[_Cut], values: IntArray) -> list[IntArray]:
    """Values of all points, block by block, as (E, p) arrays."""
    sizes = [len(block) * len(cut.weights) for block, cut in zip(sector.blocks, cuts, strict=True)]
    parts = np.split(values, np.cumsum(sizes)[:-1])
    return [part.reshape(len(block), -1) for part, block in zip(parts, sector.blocks, strict=True)]


def _numbers(sector: SectorMesh, cuts: list[_Cut], place: IntArray, count: int) -> IntArray:
    """Number (u,) of each different point: of a node that is there its own, of the others those that follow."""
    number = np.full(count, -1, dtype=np.int64)
    for block, cut, local in zip(sector.blocks, cuts, _by_block(sector, cuts, place), strict=True):
        number[local[:, cut.nodes]] = block.nodes
    new = number < 0
    number[new] = len(sector.points) + np.arange(np.count_nonzero(new))
    return number


def _positions(points: FloatArray, block: ElementBlock, cut: _Cut) -> FloatArray:
    """Positions (E p, 3) of the points of all elements."""
    return np.asarray(np.einsum("pb,ebi->epi", cut.shapes, points[block.nodes]).reshape(-1, 3))


def _finer_set(sector: SectorMesh, nodes: list[IntArray], cuts: list[_Cut], members: IntArray) -> IntArray:
    """The nodes of a set, in their order, and after them the new ones on the sides of elements between them."""
    sides = sides_on(sector.blocks, members)
    found = [np.empty(0, dtype=np.int64)]
    for index, (block, cut, local) in enumerate(zip(sector.blocks, cuts, nodes, strict=True)):
        for side, corners in enumerate(block.topology.sides):
            elements = sides.element[(sides.block == index) & (sides.side == side)]
            off = np.setdiff1d(np.arange(block.topology.corners), corners)
            on_side = np.flatnonzero((cut.weights[:, off] == 0).all(axis=1))
            found.append(local[np.ix_(elements, on_side)].ravel())
    new = np.setdiff1d(np.concatenate(found), members)
    return np.concatenate([members, new]) if np.any(new >= len(sector.points)) else members
