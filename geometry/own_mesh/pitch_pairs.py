"""Surfaces of a boundary that one pitch turns into each other, whatever their triangulation."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from geometry.elements import ElementBlock, ElementSides, IntArray
from geometry.frames import rotate_about_axis
from geometry.own_mesh.body import chosen_sides, pieces, side_corners
from geometry.own_mesh.face_pairing import Surface, lie_opposite
from geometry.own_mesh.side_quadrature import side_tables
from geometry.sector import FloatArray

_MOST_TRIED = 20_000  # nodes of a boundary with which other numbers of blades are tried
_SMOOTH = 0.866  # cosine of the largest angle between the normals of neighbouring sides of a face
_MOST_LISTED = 4  # pairs in a message
_NEAR = 0.02  # a node and its image under the pitch, over the length of an edge
_LIKE = 0.02  # relative difference of the areas of two surfaces that are one, turned
_ALONG = 0.1  # of the pitch: angle between their mean normals; of parallel planes it is the pitch
_CLOSED = 0.1  # length of the mean normal of a surface below which it is nearly closed: a whole blade, a tube
_BENT = 0.5  # of an edge: difference of the centres of two triangulations of one curved surface


@dataclass(frozen=True)
class Pair:
    """Surfaces that one pitch turns into each other."""

    # `right`, `left`: (k,) and (m,), rows of the boundary
    right: IntArray
    left: IntArray
    nodes: int  # corner nodes of the right sides
    area: float  # their area, m^2
    # `radius`, `axial`: range of the radius and of the axial coordinate, m
    radius: tuple[float, float]
    axial: tuple[float, float]
    matching: bool = True  # whether the nodes are pairs
    whole: bool = True  # whether one of them is a smooth surface to its edges; else both go on beyond

    def __str__(self) -> str:
        radius, axial = (
            f"{low:.4g} to {high:.4g}"
            for low, high in (self.radius, [round(1e3 * float(f"{end:.2g}"), 3) + 0.0 for end in self.axial])
        )
        size = f"{len(self.right)} element faces, {self.nodes} nodes, {1e6 * self.area:.3g} mm^2"
        more = "" if self.matching else ", nodes that are no pairs"
        more += "" if self.whole else ", a part of a larger surface on both sides"
        return f"{size} at radius {radius} m, x {axial} mm{more}"


def listed(pairs: Sequence[Pair]) -> str:
    """The first few of some pairs, in words."""
    more = [f"and {len(pairs) - _MOST_LISTED} more"] * (len(pairs) > _MOST_LISTED)
    return "; ".join([*map(str, pairs[:_MOST_LISTED]), *more])


@dataclass(frozen=True)
class _Boundary:
    """Corners of the sides of a boundary, its smooth surfaces, and the sums over each of them."""

    points: FloatArray
    blocks: tuple[ElementBlock, ...]
    sides: ElementSides
    corners: IntArray  # (s, 4)
    piece: IntArray  # (s,), number of the smooth surface of each side
    area: FloatArray  # (p,)
    normal: FloatArray  # (p, 3), integral over the area
    centre: FloatArray  # (p, 3)
    edge: float  # length of an edge

    def surface(self, rows: IntArray) -> Surface:
        """Some of its sides."""
        sides = chosen_sides(self.sides, rows)
        return Surface(self.points, sides.nodes(self.blocks), side_tables(self.blocks, sides))

    def nodes(self, rows: IntArray) -> IntArray:
        """Corner nodes of some of its sides."""
        return np.unique(self.corners[rows])

    def pair(self, right: IntArray, left: IntArray) -> Pair:
        """Two of its surfaces."""
        nodes = self.nodes(right)
        radius, axial = np.hypot(*self.points[nodes, 1:].T), self.points[nodes, 0]
        area = float(np.linalg.norm(_twice_area(self.points, self.corners[right]), axis=1).sum() / 2.0)
        return Pair(right, left, len(nodes), area, _range(radius), _range(axial))


def _range(values: FloatArray) -> tuple[float, float]:
    return float(values.min()), float(values.max())


def _boundary(points: FloatArray, blocks: tuple[ElementBlock, ...], sides: ElementSides) -> _Boundary:
    corners = side_corners(blocks, sides)
    piece = smooth_pieces(points, corners)
    normal = _twice_area(points, corners) / 2.0
    triangles = points[corners[:, [0, 1, 2]]], points[corners[:, [0, 2, 3]]]
    sizes = [np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=1) / 2.0 for t in triangles]
    moment = sum(size[:, None] * t.mean(axis=1) for size, t in zip(sizes, triangles, strict=True))
    sums = [np.zeros((piece.max(initial=-1) + 1, 3)) for _ in range(2)]
    np.add.at(sums[0], piece, normal)
    np.add.at(sums[1], piece, moment)
    area: FloatArray = np.bincount(piece, sizes[0] + sizes[1], minlength=len(sums[0])).astype(float)
    edge = float(np.median(np.linalg.norm(points[corners[:, 1]] - points[corners[:, 0]], axis=1)))
    return _Boundary(points, blocks, sides, corners, piece, area, sums[0], sums[1] / area[:, None], edge)


def matched_pairs(
    points: FloatArray, blocks: tuple[ElementBlock, ...], outside: ElementSides, pitch: float
) -> list[Pair]:
    """Connected pairs of surfaces of the boundary that a `pitch` (rad) turns into each other, the finest first.

    Surfaces end at sharp edges. Either all nodes have an image, whatever the sides between them are, or whole
    surfaces of any triangulation lie on each other.
    """
    return _matched(_boundary(points, blocks, outside), pitch) if len(outside) else []


def _matched(body: _Boundary, pitch: float) -> list[Pair]:
    paired = list(_by_nodes(body, pitch))
    taken = {int(k) for pair in paired if pair.whole for k in np.unique(body.piece[pair.right])}
    others = [
        body.pair(*map(np.flatnonzero, (body.piece == i, body.piece == k))) for i, k in _alike(body, pitch, taken)
    ]
    others = [pair for pair in others if lie_opposite(body.surface(pair.right), body.surface(pair.left), pitch)]
    again = {int(k) for pair in others for k in np.unique(body.piece[pair.right])}
    kept = [pair for pair in paired if pair.whole or not again & set(body.piece[pair.right].tolist())]
    return sorted([*kept, *(replace(pair, matching=False) for pair in others)], key=lambda pair: -len(pair.right))


def _by_nodes(body: _Boundary, pitch: float) -> Iterator[Pair]:
    """Pairs of surfaces all of whose nodes have an image."""
    partner = _images(body, pitch)
    right = np.flatnonzero((partner[body.corners] >= 0).all(axis=1))
    left = np.flatnonzero(np.isin(body.corners, partner[partner >= 0]).all(axis=1))
    if not len(right) or not len(left):
        return
    size = np.bincount(body.piece)
    for one, other in _joined(body, partner, right, left):
        normals = [_twice_area(body.points, body.corners[rows]) for rows in (one, other)]
        areas = [float(np.linalg.norm(normal, axis=1).sum()) for normal in normals]
        askew = float(np.linalg.norm(rotate_about_axis(normals[0].sum(axis=0), -pitch) + normals[1].sum(axis=0)))
        same = np.array_equal(np.unique(partner[body.nodes(one)]), body.nodes(other))
        like = askew < _ALONG * pitch * areas[0] and abs(areas[0] - areas[1]) < _LIKE * areas[0]
        if not (same and like) or len(np.intersect1d(one, other)):
            continue
        ends = [len(rows) == size[np.unique(body.piece[rows])].sum() for rows in (one, other)]
        yield replace(body.pair(one, other), whole=any(ends))


def _images(body: _Boundary, pitch: float) -> IntArray:
    """The node (N,) of the boundary on which each one of it falls when turned back; -1 for none."""
    from scipy.spatial import cKDTree

    nodes, partner = np.unique(body.corners), np.full(len(body.points), -1, dtype=np.int64)
    part = pieces(len(body.points), [body.corners])[nodes]
    # bodies in contact have nodes at one place: an image in the same body goes before one in another
    for others in (nodes, *(nodes[part == k] for k in np.unique(part))):
        own = others if len(others) < len(nodes) else nodes
        distance, row = cKDTree(body.points[others]).query(rotate_about_axis(body.points[own], -pitch))
        near = (distance < _NEAR * body.edge) & (others[row] != own)
        partner[own[near]] = others[row[near]]
    return partner


def _joined(body: _Boundary, partner: IntArray, right: IntArray, left: IntArray) -> list[tuple[IntArray, IntArray]]:
    """Smooth surfaces of right and of left sides that have the most nodes in common, as rows of the boundary."""
    from scipy.sparse import csr_matrix

    groups = [smooth_pieces(body.points, body.corners[rows]) for rows in (right, left)]
    counts = [int(each.max()) + 1 for each in groups]
    held = []
    for rows, group, count, place in zip(
        (right, left), groups, counts, (partner, np.arange(len(partner))), strict=True
    ):
        shape = count, len(body.points)
        index = np.repeat(group, 4), place[body.corners[rows]].ravel()
        held.append(csr_matrix((np.ones(4 * len(rows), dtype=np.int64), index), shape=shape).sign())
    common = (held[0] @ held[1].T).toarray()
    links = np.concatenate(
        [
            np.column_stack([np.arange(counts[0]), counts[0] + common.argmax(axis=1)])[common.max(axis=1) > 0],
            np.column_stack([common.argmax(axis=0), counts[0] + np.arange(counts[1])])[common.max(axis=0) > 0],
        ]
    )
    union = pieces(sum(counts), [links])
    one, other = union[groups[0]], union[counts[0] + groups[1]]
    return [(right[one == k], left[other == k]) for k in np.intersect1d(one, other)]


def _alike(body: _Boundary, pitch: float, taken: set[int]) -> list[tuple[int, int]]:
    """Smooth surfaces but those `taken` that have area, mean normal and centre of another one turned by a pitch."""
    found = []
    back, normal = (rotate_about_axis(each, -pitch) for each in (body.centre, body.normal))
    for i in range(len(body.area)):
        area = body.area[i]
        like = np.abs(body.area - area) < _LIKE * area
        mean = float(np.linalg.norm(normal[i])) / area
        like &= (
            np.linalg.norm(body.centre - back[i], axis=1)
            < (_NEAR + _BENT * np.sqrt(max(1.0 - mean, 0.0))) * body.edge
        )
        like &= np.linalg.norm(body.normal + normal[i], axis=1) < _ALONG * pitch * area
        if mean > _CLOSED and i not in taken:
            found += [(i, int(k)) for k in np.flatnonzero(like) if k != i]
    return found


def fitting_number(points: FloatArray, blocks: tuple[ElementBlock, ...], outside: ElementSides) -> int | None:
    """The number of blades with which surfaces of the boundary are one pitch apart; None where none is found."""
    body = _boundary(points, blocks, outside)
    if len(np.unique(body.corners)) > _MOST_TRIED:
        return None
    for number in _likely_numbers(body):
        if any(pair.whole for pair in _matched(body, 2.0 * np.pi / number)):
            return number
    return None


def _likely_numbers(body: _Boundary) -> list[int]:
    """Numbers of blades of smooth surfaces that may be images, the least first: with more the neighbours overlap."""
    radius, angle = np.hypot(*body.centre[:, 1:].T), np.arctan2(body.centre[:, 1], body.centre[:, 2])
    found: set[int] = set()
    for i, area in enumerate(body.area):
        like = np.abs(body.area - area) < _LIKE * area
        like &= np.abs(radius - radius[i]) < _NEAR * body.edge
        like &= np.abs(body.centre[:, 0] - body.centre[i, 0]) < _NEAR * body.edge
        like &= np.abs(body.normal[:, 0] + body.normal[i, 0]) < _LIKE * area
        for k in np.flatnonzero(like & (angle < angle[i])):
            found.add(round(2.0 * np.pi / float(angle[i] - angle[k])))
    return sorted(number for number in found if number > 1)


def smooth_pieces(points: FloatArray, corners: IntArray) -> IntArray:
    """Number (p,) of the surface of each side, corners (p, 4); surfaces end at edges where the normal turns."""
    normal = _twice_area(points, corners)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    sides = np.tile(np.arange(len(corners)), 4)
    edges = np.concatenate([np.sort(corners[:, [i, (i + 1) % 4]], axis=1) for i in range(4)])
    real = edges[:, 0] != edges[:, 1]
    sides, edges = sides[real], edges[real]
    order = np.lexsort(edges.T)
    same = (edges[order][1:] == edges[order][:-1]).all(axis=1)
    first, second = sides[order][:-1][same], sides[order][1:][same]
    smooth = np.sum(normal[first] * normal[second], axis=1) > _SMOOTH
    return pieces(len(corners), [np.column_stack([first, second])[smooth]])


def _twice_area(points: FloatArray, corners: IntArray) -> FloatArray:
    """Normals (p, 3) of sides with corners (p, 4), as long as twice the area."""
    diagonals = points[corners[:, 2]] - points[corners[:, 0]], points[corners[:, 3]] - points[corners[:, 1]]
    return np.asarray(np.cross(*diagonals))
