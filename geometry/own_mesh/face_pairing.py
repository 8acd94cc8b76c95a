"""The right face, turned back by one pitch, against the left face: mismatch, gap, overlap and normals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geometry.elements import IntArray
from geometry.own_mesh.side_quadrature import SidePoints, Triangulation, quadrature, triangulation
from geometry.sector import FloatArray

# Of nodes that are pairs, over the distance of a node to the next: largest scatter across the normal, and largest
# distance. A gap along the circumference moves all nodes of an oblique face across its normal by the same amount.
MATCHING, _SHIFT = 0.02, 0.25
_MANY = 500  # sides
_NEAREST = 12  # triangles looked at for each point
_FLAT = 1e-6  # cosine of the angle of a ray to a normal below which it misses the triangle
_EDGE = 1e-2  # a point this far outside a triangle, in its coordinates, is on it


@dataclass(frozen=True)
class Surface:
    """A face of the sector: points of the mesh, its nodes and sides."""

    points: FloatArray  # (N, 3), nodes of the mesh, m
    nodes: IntArray  # (k,), nodes of the face
    tables: list[IntArray]  # (s, m), nodes of its sides, see `side_tables`

    @property
    def n_sides(self) -> int:
        """Number of sides."""
        return sum(len(table) for table in self.tables)

    def quadrature(self) -> SidePoints:
        """Its quadrature points; fewer of each side where there are many sides."""
        return quadrature(self.points, self.tables, 3 if self.n_sides <= _MANY else 2)

    def samples(self) -> SidePoints:
        """Few quadrature points, to look at its distance from another face."""
        return quadrature(self.points, self.tables, 2 if self.n_sides <= _MANY else 1)

    def triangles(self) -> Triangulation:
        """Its triangulation."""
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


def gap_along(at: FloatArray, normal: FloatArray, surface: Triangulation, reach: float) -> FloatArray:
    """Distance (k,) along the normals (k, 3) from points (k, 3) to a surface; not a number beyond `reach`."""
    from scipy.spatial import cKDTree

    count = min(_NEAREST, len(surface.corners))
    near = cKDTree(surface.corners.mean(axis=1)).query(at, k=count)[1].reshape(len(at), count)
    corner = surface.corners[near]
    first, second = corner[:, :, 1] - corner[:, :, 0], corner[:, :, 2] - corner[:, :, 0]
    ray = np.broadcast_to(-normal[:, None], first.shape)
    matrix = np.stack([first, second, ray], axis=-1)
    flat = np.abs(np.linalg.det(matrix)) <= _FLAT * np.linalg.norm(np.cross(first, second), axis=-1)
    matrix = np.where(flat[..., None, None], np.eye(3), matrix)
    u, v, distance = np.moveaxis(np.linalg.solve(matrix, (at[:, None] - corner[:, :, 0])[..., None])[..., 0], -1, 0)
    outside = flat | (u < -_EDGE) | (v < -_EDGE) | (u + v > 1.0 + _EDGE) | (np.abs(distance) > reach)
    rows = np.arange(len(at))
    best = np.argmin(np.where(outside, np.inf, np.abs(distance)), axis=1)
    u, v = u[rows, best], v[rows, best]
    # from the flat triangle to the curved side
    point = surface.on_surface(near[rows, best], np.stack([1.0 - u - v, u, v], axis=1))
    return np.where(outside[rows, best], np.nan, np.sum((point - at) * normal, axis=1))


def overlap(points: SidePoints, gap: FloatArray) -> float:
    """Share of the area of a face that has the other face opposite."""
    return float(points.area[np.isfinite(gap)].sum() / points.area.sum())
