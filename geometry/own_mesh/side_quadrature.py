"""Sides of elements as curved surfaces: shape functions, quadrature, normals and a fine triangulation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from geometry.elements import ElementBlock, ElementSides, IntArray
from geometry.sector import FloatArray

_TRIANGLE = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
_SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
# powers of (u, v) in the shape functions of a side, by its number of nodes
_POWERS = {
    3: ((0, 0), (1, 0), (0, 1)),
    4: ((0, 0), (1, 0), (0, 1), (1, 1)),
    6: ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)),
    8: ((0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2), (2, 1), (1, 2)),
}
_GAUSS = 3  # points in each half of a side
_PARTS = {3: 1, 4: 2, 6: 4, 8: 4}  # of the edge of a side in the triangulation, by its number of nodes


@dataclass(frozen=True)
class SidePoints:
    """Quadrature points of a surface."""

    position: FloatArray  # (q, 3), points, m, and unit normals out of the body
    normal: FloatArray  # (q, 3), points, m, and unit normals out of the body
    area: FloatArray  # (q,), shares of the area, m^2

    @property
    def centroid(self) -> FloatArray:
        """Centroid (3,), m."""
        return np.asarray(self.area @ self.position / self.area.sum())

    @property
    def mean_normal(self) -> FloatArray:
        """Mean of the normals, (3,)."""
        return np.asarray(self.area @ self.normal / self.area.sum())


def side_tables(blocks: tuple[ElementBlock, ...], surface: ElementSides) -> list[IntArray]:
    """Nodes (s, m) of the sides of a surface, one table for each number of nodes m: corners, then mid-side nodes."""
    tables: dict[int, list[IntArray]] = {}
    for index, block in enumerate(blocks):
        for side in range(len(block.topology.sides)):
            elements = surface.element[(surface.block == index) & (surface.side == side)]
            nodes = list(block.topology.side_nodes(side))
            if len(elements):
                tables.setdefault(len(nodes), []).append(block.nodes[elements][:, nodes])
    return [np.concatenate(parts) for _, parts in sorted(tables.items())]


def quadrature(points: FloatArray, tables: list[IntArray], count: int = _GAUSS) -> SidePoints:
    """`count` Gauss points in the halves of each direction of each side; triangles are collapsed squares."""
    parts = []
    for table in tables:
        at, weight = _rule(table.shape[1] in (3, 6), count)
        values, slopes = side_shapes(table.shape[1], at)
        nodes = points[table]
        position = np.einsum("qm,smi->sqi", values, nodes)
        tangents = np.einsum("qmd,smi->dsqi", slopes, nodes)
        normal = np.cross(tangents[0], tangents[1])
        length = np.linalg.norm(normal, axis=-1)
        unit = normal / np.where(length > 0.0, length, 1.0)[..., None]
        parts.append((position.reshape(-1, 3), unit.reshape(-1, 3), (length * weight).ravel()))
    return SidePoints(*(np.concatenate(each) for each in zip(*parts, strict=True)))


@dataclass(frozen=True)
class Triangulation:
    """Triangles of a surface; curved sides are cut into small ones."""

    corners: FloatArray  # (t, 3, 3), corners of the triangles, on the surface, m
    reference: FloatArray  # (t, 3, 2), corners of the triangles on the reference side
    nodes: list[FloatArray]  # (s, m, 3), nodes of the sides, m, one table for each number of nodes
    owner: IntArray  # (t, 2), table, and side in it, of each triangle

    def on_surface(self, triangle: IntArray, weight: FloatArray) -> FloatArray:
        """Points (k, 3) of the curved surface at barycentric coordinates (k, 3) of some triangles (k,)."""
        at = np.einsum("kc,kcd->kd", weight, self.reference[triangle])
        found = np.empty((len(triangle), 3))
        for number, nodes in enumerate(self.nodes):
            here = np.flatnonzero(self.owner[triangle, 0] == number)
            values, _ = side_shapes(nodes.shape[1], at[here])
            found[here] = np.einsum("km,kmi->ki", values, nodes[self.owner[triangle[here], 1]])
        return found

    def turned(self, rotation: FloatArray) -> Triangulation:
        """The triangles in other axes, given by a matrix (3, 3)."""
        return replace(self, corners=self.corners @ rotation.T, nodes=[nodes @ rotation.T for nodes in self.nodes])


def triangulation(points: FloatArray, tables: list[IntArray]) -> Triangulation:
    """The triangles of a surface."""
    corners, reference, owner = [], [], []
    for number, table in enumerate(tables):
        at, triangles = _cuts(table.shape[1] in (3, 6), _PARTS[table.shape[1]])
        values, _ = side_shapes(table.shape[1], at)
        corners.append(np.einsum("qm,smi->sqi", values, points[table])[:, triangles].reshape(-1, 3, 3))
        reference.append(np.tile(at[triangles], (len(table), 1, 1)))
        side = np.repeat(np.arange(len(table)), len(triangles))
        owner.append(np.column_stack([np.full(len(side), number), side]))
    nodes = [points[table] for table in tables]
    return Triangulation(np.concatenate(corners), np.concatenate(reference), nodes, np.concatenate(owner))


def side_shapes(count: int, at: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values (q, m) and slopes (q, m, 2) of the shape functions of a side of m nodes at points (q, 2)."""
    powers = np.array(_POWERS[count])
    inverse: FloatArray = _coefficients(count)
    values = _monomials(at, powers)
    slopes = []
    for k in range(2):
        lower = powers.copy()
        lower[:, k] = np.maximum(lower[:, k] - 1, 0)
        slopes.append((_monomials(at, lower) * powers[:, k]) @ inverse)
    return np.asarray(values @ inverse), np.stack(slopes, axis=-1)


def _monomials(at: FloatArray, powers: IntArray) -> FloatArray:
    return np.asarray(at[:, None, 0] ** powers[:, 0] * at[:, None, 1] ** powers[:, 1])


@cache
def _coefficients(count: int) -> FloatArray:
    """Coefficients (m, m) of the monomials in the shape functions, from their nodes."""
    corners = np.array(_TRIANGLE if count in (3, 6) else _SQUARE)
    nodes = corners if count in (3, 4) else np.concatenate([corners, (corners + np.roll(corners, -1, axis=0)) / 2])
    return np.asarray(np.linalg.inv(_monomials(nodes, np.array(_POWERS[count]))), dtype=np.float64)


@cache
def _rule(triangle: bool, count: int) -> tuple[FloatArray, FloatArray]:
    """Points (q, 2) and weights (q,) on the reference side."""
    point, weight = np.polynomial.legendre.leggauss(count)
    line = np.concatenate([0.25 + 0.25 * point, 0.75 + 0.25 * point])
    share = np.concatenate([weight, weight]) / 4.0
    u, v = (each.ravel() for each in np.meshgrid(line, line, indexing="ij"))
    product = np.outer(share, share).ravel()
    if triangle:
        return np.column_stack([u, v * (1.0 - u)]), product * (1.0 - u)
    return np.column_stack([u, v]), product


@cache
def _cuts(triangle: bool, parts: int) -> tuple[FloatArray, IntArray]:
    """Points (q, 2) of a regular division of the reference side, and triangles (t, 3) between them."""
    index: dict[tuple[int, int], int] = {}
    for i in range(parts + 1):
        for j in range(parts + 1 - (i if triangle else 0)):
            index[i, j] = len(index)
    triangles = []
    for i, j in index:
        if (i + 1, j) in index and (i, j + 1) in index:
            triangles.append((index[i, j], index[i + 1, j], index[i, j + 1]))
        if (i + 1, j + 1) in index:
            triangles.append((index[i + 1, j], index[i + 1, j + 1], index[i, j + 1]))
    return np.array(list(index)) / parts, np.array(triangles, dtype=np.int64)
