"""The right face, turned back by one pitch, against the left face: mismatch, gap, overlap and normals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geometry.elements import IntArray
from geometry.own_mesh.side_quadrature import SidePoints, quadrature, triangulation
from geometry.sector import FloatArray

# Of nodes that are pairs, over the distance of a node to the next: largest scatter across the normal, and largest
# distance. A gap along the circumference moves all nodes of an oblique face across its normal by the same amount.
MATCHING, _SHIFT = 0.02, 0.25
_NEAREST = 24  # triangles looked at for each point
_EDGE = 1e-2  # a point this far outside a triangle, in its coordinates, is on it


@dataclass(frozen=True)
class Surface:
    """A face of the sector: points of the mesh, its nodes and sides.

    Attributes
    ----------
    points : (N, 3) array
        Nodes of the mesh, m.
    nodes : (k,) array
        Nodes of the face.
    tables : list of (s, m) array
        Nodes of its sides, see `side_tables`.
    """

    points: FloatArray
    nodes: IntArray
    tables: list[IntArray]

    def quadrature(self) -> SidePoints:
        """Its quadrature points."""
        return quadrature(self.points, self.tables)

    def triangles(self) -> FloatArray:
        """Its triangulation (t, 3, 3)."""
        return triangulation(self.points, self.tables)


def partners(at: FloatArray, others: FloatArray, normal: FloatArray) -> tuple[IntArray | None, float]:
    """The row (k,) of `others` (m, 3) that each point (k, 3) falls on along the normals (k, 3), and the mismatch.

    The mismatch is the largest distance across the normal. None for the rows where the points are no pairs.
    """
    from scipy.spatial import cKDTree

    distance, row = cKDTree(others).query(at)
    offset = others[row] - at
    across = offset - np.sum(offset * normal, axis=1)[:, None] * normal
    mismatch = float(np.linalg.norm(across, axis=1).max())
    if len(at) != len(others) or len(np.unique(row)) != len(row) or len(at) < 2:
        return None, mismatch
    spacing = float(np.median(cKDTree(at).query(at, k=2)[0][:, 1]))
    scatter = float(np.linalg.norm(across - across.mean(axis=0), axis=1).max())
    paired = scatter < MATCHING * spacing and distance.max() < _SHIFT * spacing
    return (row if paired else None), mismatch


def gap_along(at: FloatArray, normal: FloatArray, triangles: FloatArray, reach: float) -> FloatArray:
    """Distance (k,) along the normals (k, 3) from points (k, 3) to triangles (t, 3, 3); nan beyond `reach`."""
    from scipy.spatial import cKDTree

    count = min(_NEAREST, len(triangles))
    near = cKDTree(triangles.mean(axis=1)).query(at, k=count)[1].reshape(len(at), count)
    corner = triangles[near]
    first, second = corner[:, :, 1] - corner[:, :, 0], corner[:, :, 2] - corner[:, :, 0]
    ray = np.broadcast_to(-normal[:, None], first.shape)
    matrix = np.stack([first, second, ray], axis=-1)
    flat = np.abs(np.linalg.det(matrix)) <= 1e-12 * np.linalg.norm(np.cross(first, second), axis=-1)
    matrix = np.where(flat[..., None, None], np.eye(3), matrix)
    u, v, distance = np.moveaxis(np.linalg.solve(matrix, (at[:, None] - corner[:, :, 0])[..., None])[..., 0], -1, 0)
    outside = flat | (u < -_EDGE) | (v < -_EDGE) | (u + v > 1.0 + _EDGE) | (np.abs(distance) > reach)
    best = np.argmin(np.where(outside, np.inf, np.abs(distance)), axis=1)
    rows = np.arange(len(at))
    return np.where(outside[rows, best], np.nan, distance[rows, best])


def overlap(points: SidePoints, gap: FloatArray) -> float:
    """Share of the area of a face that has the other face opposite."""
    return float(points.area[np.isfinite(gap)].sum() / points.area.sum())
