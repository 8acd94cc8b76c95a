"""Sides of elements as curved surfaces: quadrature, smooth normals, a fine triangulation, contact points on them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from geometry.elements import ElementBlock, ElementSides, IntArray
from geometry.frames import contact_frames
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
_HIGHEST = 4  # degree
_ON_NODE = 0.03  # a centre this near to a node, over the size of its cell, is the node
_EVEN, _ROUNDS = 0.4, 60  # smallest part of the face over the mean, and rounds to reach it
_SAME = 1e-6  # points nearer than this, over the length of the face, are at the same coordinate


@dataclass(frozen=True)
class SidePoints:
    """Quadrature points of a surface."""

    # `position`, `normal`: (q, 3), points, m, and unit normals out of the body
    position: FloatArray
    normal: FloatArray
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


def face_axes(points: SidePoints) -> FloatArray:
    """Coordinates of a face, rows (2, 3): t1 and t2 at its centre."""
    normal = points.mean_normal / np.linalg.norm(points.mean_normal)
    return contact_frames(points.centroid[None], normal[None])[0, :2]


def normals_at(at: FloatArray, points: SidePoints, n_sides: int) -> FloatArray:
    """Unit normals (k, 3) at points (k, 3) of a face, by least squares over its quadrature points.

    The degree of the polynomial in the coordinates of the face grows with the number of its sides.
    """
    degree = min(_HIGHEST, int(np.sqrt(n_sides)))
    axes, centre = face_axes(points), points.centroid
    scale = np.abs((points.position - centre) @ axes.T).max()

    def basis(position: FloatArray) -> FloatArray:
        s, r = ((position - centre) @ axes.T / scale).T
        return np.stack([s**i * r**j for i in range(degree + 1) for j in range(degree + 1 - i)], axis=1)

    root = np.sqrt(points.area / points.area.mean())[:, None]
    mean = points.mean_normal
    fit = np.linalg.lstsq(basis(points.position) * root, (points.normal - mean) * root, rcond=1e-10)[0]
    found = mean + basis(at) @ fit
    return np.asarray(found / np.linalg.norm(found, axis=1)[:, None])


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
