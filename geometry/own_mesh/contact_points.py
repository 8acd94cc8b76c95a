"""Contact points of a face: the centres of a grid of cells of equal area, with tributary areas."""

from __future__ import annotations

import numpy as np

from geometry.elements import IntArray
from geometry.own_mesh.side_quadrature import SidePoints
from geometry.own_mesh.smooth_normals import face_axes
from geometry.sector import FloatArray

_ON_NODE = 0.03  # a centre this near to a node, over the size of its cell, is the node
_EVEN, _ROUNDS = 0.4, 60  # smallest part of the face over the mean, and rounds to reach it
_SAME = 1e-6  # points nearer than this, over the length of the face, are at the same coordinate


def cell_centres(points: SidePoints, grid: tuple[int, int]) -> FloatArray:
    """Centres (n1 n2, 3) of n2 strips of equal area along t2, each of n1 cells of equal area along t1.

    Point k = i_t1 + n1 i_t2. On a curved face a centre may lie off the surface by the height of its cell.
    """
    s, r = ((points.position - points.centroid) @ face_axes(points).T).T
    strip = _parts(r, points.area, grid[1])
    cell = np.empty(len(s), dtype=np.int64)
    for k in range(grid[1]):
        rows = np.flatnonzero(strip == k)
        cell[rows] = _parts(s[rows], points.area[rows], grid[0]) + grid[0] * k
    count = grid[0] * grid[1]
    weight = np.bincount(cell, points.area, count)
    centre = np.stack([np.bincount(cell, points.area * points.position[:, i], count) for i in range(3)], axis=1)
    return np.asarray(centre / weight[:, None])


def evened(centres: FloatArray, points: SidePoints) -> FloatArray:
    """The centres (k, 3) moved so that none has next to nothing of the face, where its shape would have it so.

    Each becomes the centroid of the part of the face that is nearest to it, time and again [1]_; one without a part
    starts anew where the face is farthest from all.

    References
    ----------
    .. [1] S. Lloyd, "Least squares quantization in PCM", IEEE Transactions on Information Theory 28 (1982) 129-137.
    """
    from scipy.spatial import cKDTree

    for _ in range(_ROUNDS):
        distance, owner = cKDTree(centres).query(points.position)
        area = np.bincount(owner, points.area, len(centres))
        if area.min() > _EVEN * area.mean():
            break
        sums = [np.bincount(owner, points.area * points.position[:, i], len(centres)) for i in range(3)]
        centres = np.stack(sums, axis=1) / np.where(area > 0.0, area, 1.0)[:, None]
        if area.min() <= 0.0:
            centres[np.argmin(area)] = points.position[np.argmax(distance)]
    return centres


def on_nodes(centres: FloatArray, nodes: FloatArray, area: float) -> IntArray | None:
    """The row (k,) of the `nodes` (m, 3) that each centre (k, 3) falls on; None where one falls on none."""
    from scipy.spatial import cKDTree

    distance, row = cKDTree(nodes).query(centres)
    size = np.sqrt(area / len(centres))
    return np.asarray(row) if distance.max() < _ON_NODE * size and len(np.unique(row)) == len(row) else None


def tributary_areas(centres: FloatArray, points: SidePoints) -> FloatArray:
    """Areas (k,), m^2, of the parts of the face that are nearest to each of the centres (k, 3)."""
    from scipy.spatial import cKDTree

    owner = cKDTree(centres).query(points.position)[1]
    return np.asarray(np.bincount(owner, points.area, len(centres)), dtype=np.float64)


def _parts(x: FloatArray, weight: FloatArray, count: int) -> IntArray:
    """The part (q,), of `count` of equal weight along x, that each point (q,) with a weight falls in.

    Points at the same x fall in the same part.
    """
    order = np.argsort(x, kind="stable")
    apart = np.diff(x[order]) > _SAME * np.ptp(x)
    group = np.empty(len(x), dtype=np.int64)
    group[order] = np.concatenate([[0], np.cumsum(apart)])
    total = np.bincount(group, weight)
    middle = np.cumsum(total) - 0.5 * total
    return np.minimum(middle / weight.sum() * count, count - 1).astype(np.int64)[group]
