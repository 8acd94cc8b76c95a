"""Sets that a user does not name, found by geometry where that is safe."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from geometry.elements import ElementBlock, ElementSides, IntArray
from geometry.errors import OwnMeshError
from geometry.frames import rotate_about_axis
from geometry.own_mesh.body import chosen_sides, pieces, side_corners
from geometry.sector import FloatArray

_INNERMOST = 1e-4  # of the radial extent of the mesh: nodes of the root are within this of the hub or of its plane
_MOST_TRIED = 20_000  # nodes of a boundary with which other numbers of blades are tried
_SMOOTH = 0.866  # cosine of the largest angle between the normals of neighbouring sides of a face
_MOST_LISTED = 4  # pairs in a message
_NEAR = 0.02  # a node and its image under the pitch, over the length of an edge


@dataclass(frozen=True)
class Pair:
    """Sides that one pitch turns into each other."""

    right: IntArray  # (k,), rows of the boundary
    left: IntArray  # (k,), rows of the boundary
    nodes: int  # corner nodes of the right sides
    area: float  # their area, m^2
    radius: tuple[float, float]  # range of the radius and of the axial coordinate, m
    axial: tuple[float, float]  # range of the radius and of the axial coordinate, m

    def __str__(self) -> str:
        radius, axial = (
            f"{low:.4g} to {high:.4g}"
            for low, high in (self.radius, [round(1e3 * float(f"{end:.2g}"), 3) + 0.0 for end in self.axial])
        )
        size = f"{len(self.right)} sides, {self.nodes} nodes, {1e6 * self.area:.3g} mm^2"
        return f"{size} at radius {radius} m, x {axial} mm"


def find_root(points: FloatArray, blocks: tuple[ElementBlock, ...], outside: ElementSides) -> ElementSides:
    """The innermost cylindrical or plane surface of the boundary, of points (N, 3) with the axis x.

    Raises OwnMeshError where there is none.
    """
    corners = side_corners(blocks, outside)
    radius = np.hypot(points[:, 1], points[:, 2])
    middle = points[np.argmin(radius)] * [0.0, 1.0, 1.0]
    mean = np.array([0.0, *points[:, 1:].mean(axis=0)])
    for direction in (middle, mean):
        for depth in (radius, points @ (direction / (np.linalg.norm(direction) or 1.0))):
            held = depth < depth.min() + _INNERMOST * np.ptp(radius)
            rows = np.flatnonzero(held[corners].all(axis=1))
            if len(rows):
                return chosen_sides(outside, rows)
    told = "name the clamped nodes; the body has no innermost cylindrical or plane surface"
    raise OwnMeshError("mesh.sets.root", None, told)


def find_faces(
    points: FloatArray, blocks: tuple[ElementBlock, ...], outside: ElementSides, n_blades: int
) -> tuple[ElementSides, ElementSides, list[str]]:
    """Right and left face: the only connected pair of surfaces whose nodes one pitch turns into each other; doubts.

    Raises OwnMeshError where there is none, or more than one.
    """
    found = matched_pairs(points, blocks, outside, 2.0 * np.pi / n_blades)
    keys = "contact_right"
    if not found:
        told = f"name the faces: no two surfaces of the body are one pitch ({360.0 / n_blades:.6g} degrees) apart"
        other = fitting_number(points, blocks, outside)
        told += f"; they would be with n_blades = {other}" if other else ", node by node"
        raise OwnMeshError(f"mesh.sets.{keys}", None, told)
    radius = np.hypot(*points[np.unique(side_corners(blocks, outside)), 1:].T)
    innermost = radius.min() + _INNERMOST * np.ptp(radius)
    down = [pair for pair in found if pair.radius[0] < innermost]
    if len(found) > 1:
        told = f"name the faces: {len(found)} pairs of surfaces are one pitch apart: {listed(found)}"
        if down:
            told += "; what reaches the innermost radius may be cut faces of a disk: cyclic_right and cyclic_left"
        raise OwnMeshError(f"mesh.sets.{keys}", None, told)
    doubts = [
        f"the contact faces found reach the innermost radius ({found[0]}): if they are the cut faces of a disk, name "
        "them cyclic_right and cyclic_left"
    ]
    return chosen_sides(outside, found[0].right), chosen_sides(outside, found[0].left), doubts if down else []


def matched_pairs(
    points: FloatArray, blocks: tuple[ElementBlock, ...], outside: ElementSides, pitch: float
) -> list[Pair]:
    """Connected pairs of surfaces of the boundary that a `pitch` (rad) turns into each other, node by node."""
    from scipy.spatial import cKDTree

    corners = side_corners(blocks, outside)
    nodes = np.unique(corners)
    edge = float(np.median(np.linalg.norm(points[corners[:, 1]] - points[corners[:, 0]], axis=1)))
    image = rotate_about_axis(points[nodes], -pitch)
    distance, row = cKDTree(points[nodes]).query(image)
    partner = np.full(len(points), -1, dtype=np.int64)
    partner[nodes[distance < _NEAR * edge]] = nodes[row[distance < _NEAR * edge]]
    image_of = np.isin(corners, partner[partner >= 0]).all(axis=1)
    known = {tuple(np.sort(corners[k]).tolist()): int(k) for k in np.flatnonzero(image_of)}
    pairs = []
    for k in np.flatnonzero((partner[corners] >= 0).all(axis=1)):
        other = known.get(tuple(np.sort(partner[corners[k]]).tolist()))
        if other is not None and other != k:
            pairs.append((int(k), other))
    return _connected(points, corners, np.array(pairs, dtype=np.int64).reshape(-1, 2))


def fitting_number(points: FloatArray, blocks: tuple[ElementBlock, ...], outside: ElementSides) -> int | None:
    """The number of blades with which surfaces of the boundary are one pitch apart; None where none is found."""
    corners = side_corners(blocks, outside)
    nodes = np.unique(corners)
    turn = np.arctan2(points[nodes, 1], points[nodes, 2])
    least = max(2, int(np.pi / max(np.ptp(turn), 1e-2)))
    if len(nodes) > _MOST_TRIED:
        return None
    for count in range(least, 8 * least + 32):
        if pairs := matched_pairs(points, blocks, outside, 2.0 * np.pi / count):
            # on a coarse mesh several numbers match within the tolerance: the angle between the surfaces tells
            right, left = (points[np.unique(corners[rows])].mean(axis=0) for rows in (pairs[0].right, pairs[0].left))
            apart = float(np.arctan2(*right[1:]) - np.arctan2(*left[1:]))
            near = round(2.0 * np.pi / apart) if apart > 0.0 else count
            return near if matched_pairs(points, blocks, outside, 2.0 * np.pi / near) else count
    return None


def _connected(points: FloatArray, corners: IntArray, pairs: IntArray) -> list[Pair]:
    """Pairs of sides (p, 2), right and left, collected into surfaces that are connected and without a sharp edge."""
    if len(pairs) == 0:
        return []
    piece = _smooth_pieces(points, corners[pairs[:, 0]])
    found = []
    for number in np.unique(piece):
        rows = pairs[piece == number]
        at = points[np.unique(corners[rows[:, 0]])]
        radius = np.hypot(at[:, 1], at[:, 2])
        ranges = ((float(each.min()), float(each.max())) for each in (radius, at[:, 0]))
        area = float(np.linalg.norm(_twice_area(points, corners[rows[:, 0]]), axis=1).sum() / 2.0)
        found.append(Pair(rows[:, 0], rows[:, 1], len(at), area, *ranges))
    return sorted(found, key=lambda pair: -len(pair.right))


def _smooth_pieces(points: FloatArray, corners: IntArray) -> IntArray:
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


def listed(pairs: Sequence[Pair]) -> str:
    """The first few of some pairs, in words."""
    more = [f"and {len(pairs) - _MOST_LISTED} more"] * (len(pairs) > _MOST_LISTED)
    return "; ".join([*map(str, pairs[:_MOST_LISTED]), *more])
