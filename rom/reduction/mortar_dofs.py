"""Mortar projection: displacement of a contact face projected on polynomials, with contact nodes at Gauss points.

On a face with the coordinates s along t1 and r along the radius, P u is the L2 projection of the displacement u on
the tensor polynomials of degrees n1 - 1 and n2 - 1. The contact nodes are the n1 x n2 Gauss points x_k of the face,
psi_k is the Lagrange polynomial that is 1 at x_k and 0 at the other points. Gauss points make the psi_k orthogonal,
so that

    u_k = (P u)(x_k) = int psi_k u dA / w_k,       w_k = int psi_k dA.

With the springs kn w_k / A at the contact nodes their energy is that of springs spread over the face,

    1/2 sum_k kn w_k / A d_k^2 = 1/2 int kn / A (P d)^2 dA :

resultant and, from two points a direction on, rotational stiffness of the face are exact. For kn -> infinity the
contact is a mortar tie [1]_. The Gauss points are those of the face's own distribution of area, by the Lanczos
process [2]_: exactly orthogonal on a face whose area element is a product f(s) g(r).

A face that is no rectangle is straightened to one. With the chord from s_a(r) to s_b(r) that the face has at a radius
r, the coordinate

    xi = (s - (s_a + s_b) / 2) / ((s_b - s_a) / 2)

makes the area element a product, dA = (s_b - s_a) / 2 dxi dr on a flat face: tensor polynomials in (xi, r) with Gauss
points of the two measures are orthogonal. On parallelograms and trapezia s is in their space, from two points a
direction on: rigid rotations are exact.

References
----------
.. [1] B. I. Wohlmuth, "A mortar finite element method using dual spaces for the Lagrange multiplier", SIAM Journal on
   Numerical Analysis 38 (2000) 989-1012.
.. [2] G. H. Golub, J. H. Welsch, "Calculation of Gauss quadrature rules", Mathematics of Computation 23 (1969)
   221-230.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from geometry.elements import ElementBlock, ElementSides, sides_on
from rom.errors import RomParameterError
from rom.finite_elements.discretisation import Discretisation
from rom.reduction.face_integrals import FacePoints, Rule, face_points, opposite_points, sides_of, with_points_at

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from geometry.elements import ElementSides
    from geometry.sector import ContactFace, SectorMesh

Array = NDArray[np.float64]
_SAME = 1e-7  # corners of the outline nearer than this, over the height of the face, are at one radius
_INSIDE = (0.25, 0.75)  # where in an interval its chord is taken
Grid = tuple[int, int]
_OBLIQUE = 0.05  # largest scalar product of two psi_k over the largest w_k
_RECTANGLE = 0.005  # the same, where the face is near enough to a rectangle
_CURVED = 2  # more points in the rule of a straightened face
_TANGENTIAL = 0.2  # radial part of t2 on a face that is nearly tangential to the ring
_CURVATURE = 2  # degree, in s, of the fit of the contact frames
_TURNED = 1e-4  # entries of the frames that this fit may miss


@dataclass(frozen=True)
class Outline:
    """Chords of a face between the radii of the corners of its outline."""

    radius: Array  # (m + 1,), radii of the corners, rising
    # `low`, `high`: (m, 2), in each interval the chord's ends as polynomials: value at the lower radius, and slope
    low: Array
    high: Array

    def straightened(self, s: Array, r: Array) -> Array:
        """xi (q,) of points with coordinates s and r (q,)."""
        interval = np.clip(np.searchsorted(self.radius, r) - 1, 0, len(self.low) - 1)
        above = r - self.radius[interval]
        low, high = (ends[interval, 0] + ends[interval, 1] * above for ends in (self.low, self.high))
        return np.asarray((2.0 * s - low - high) / (high - low))


def outline_edges(blocks: tuple[ElementBlock, ...], surface: ElementSides) -> NDArray[np.int64]:
    """Edges (e, 2) of a surface that belong to one of its sides only; halves of an edge with a mid-side node."""
    edges = []
    for index, block in enumerate(blocks):
        for side in range(len(block.topology.sides)):
            elements = surface.element[(surface.block == index) & (surface.side == side)]
            nodes = block.nodes[elements][:, list(block.topology.side_nodes(side))]
            count = len(block.topology.sides[side])
            order = list(range(count))
            if block.topology.quadratic:
                order = [k for corner in range(count) for k in (corner, count + corner)]
            ring = nodes[:, order]
            edges.append(np.stack([ring, np.roll(ring, -1, axis=1)], axis=-1).reshape(-1, 2))
    every = np.sort(np.concatenate(edges), axis=1)
    unique, uses = np.unique(every, axis=0, return_counts=True)
    return np.asarray(unique[uses == 1])


def outline(s: Array, r: Array) -> Outline | None:
    """The outline of edges with ends at s and r (e, 2); None where a line of constant r cuts it more than twice."""
    every = np.unique(r)
    height = every[-1] - every[0]
    radius = every[np.concatenate([[True], np.diff(every) > _SAME * height])]
    radius[-1] = every[-1]
    ends = []
    for share in _INSIDE:
        at = radius[:-1] + share * np.diff(radius)
        below, above = r.min(axis=1)[:, None] < at, r.max(axis=1)[:, None] > at
        cut = below & above
        if (cut.sum(axis=0) != 2).any():
            return None
        slope = (s[:, 1] - s[:, 0]) / np.where(r[:, 1] == r[:, 0], 1.0, r[:, 1] - r[:, 0])
        there = s[:, :1] + slope[:, None] * (at - r[:, :1])
        ends.append((np.where(cut, there, np.inf).min(axis=0), np.where(cut, there, -np.inf).max(axis=0)))
    steps = (_INSIDE[1] - _INSIDE[0]) * np.diff(radius)
    found = []
    for first, second in zip(*ends, strict=True):
        slope = (second - first) / steps
        found.append(np.stack([first - slope * _INSIDE[0] * np.diff(radius), slope], axis=1))
    return Outline(radius, found[0], found[1])


def contact_grid(position: Array, frame: Array) -> Grid:
    """Contact nodes of a face along t1 and along the radius; node k = i_t1 + n_t1 i_r.

    Shapes: `position` (n_c, 3), `frame` (n_c, 3, 3) with rows t1, t2, n.

    Raises RomParameterError where the nodes are no such grid.
    """
    s, r = face_coordinates(position, frame, position)
    steps = np.diff(s)
    if len(s) > 1 and abs(steps[0]) < abs(r[1] - r[0]):  # the second node is above the first, not beside it
        return 1, len(s)
    backward = np.flatnonzero(steps * steps[:1] < 0.0)
    along = int(backward[0]) + 1 if len(backward) else len(s)
    if len(s) % along:
        raise RomParameterError("rom", "contact_dofs", "mortar", "needs contact nodes in a grid")
    return along, len(s) // along


def mortar_projections(
    discretisation: Discretisation, sector: SectorMesh, grid: Grid
) -> tuple[csr_matrix, NDArray[np.float64], NDArray[np.float64]]:
    """W (m, n) from n mesh nodes, frames (m, 3, 3) and shares w_k / A (n_c,) of the face's area.

    W u are the displacements u_k of the right, then of the left face; each row sums to 1. The left contact nodes are
    the right ones turned back by one pitch, whether the meshes of the faces match or not. A face that is far from a
    rectangle is straightened to one.
    Raises RomParameterError where the mesh has no node sets of the faces, or a face cannot be straightened.
    """
    from scipy.sparse import vstack

    found = _projections(discretisation, sector, grid, False)
    if _oblique(found) > _RECTANGLE:
        found = min(found, _projections(discretisation, sector, grid, True), key=_oblique)
    if _oblique(found) > _OBLIQUE:
        allowed = 'needs contact faces that lines along t1 cross once; "patch" is for any shape'
        raise RomParameterError("rom", "contact_dofs", "mortar", allowed)
    right, *others = found
    rows = [right.rows]
    for left in others:
        targets = opposite_points(right.rows @ discretisation.positions, sector)
        rows.append(with_points_at(left.rows, targets, discretisation.positions, left.points))
    faces = [face for _, face in sides_of(sector)]
    frames = np.concatenate([_frames(face, each.at) for face, each in zip(faces, found, strict=True)])
    return vstack(rows, format="csr"), frames, right.weight / right.weight.sum()


@dataclass(frozen=True)
class _Projection:
    """Mortar projection of one face."""

    rows: csr_matrix  # (n_c, n), W
    points: FacePoints  # quadrature points
    at: NDArray[np.float64]  # (2, n_c), coordinates s, r of the contact nodes, m
    weight: NDArray[np.float64]  # (n_c,), w_k, m^2
    oblique: float  # largest scalar product of two psi_k over the largest w_k; infinite where a w_k is not above 0


def _oblique(projections: Sequence[_Projection]) -> float:
    """The worst of both faces; infinite where there are none."""
    return max((projection.oblique for projection in projections), default=np.inf)


def _projections(
    discretisation: Discretisation, sector: SectorMesh, grid: Grid, straighten: bool
) -> list[_Projection]:
    """Right and left projection in the coordinates (s, r), or in those of the faces straightened to rectangles.

    Empty where the faces cannot be straightened.
    """
    found = []
    rule = _element_rule(max(grid) + _CURVED * straighten)
    for side, face in sides_of(sector):
        points = face_points(discretisation, sector, side, "mortar", rule)
        s, r = _coordinates(face, points.position)
        if straighten:
            edges = outline_edges(sector.blocks, _surface(sector, side))
            ends = _coordinates(face, sector.points[edges.ravel()])
            chords = outline(*(end.reshape(-1, 2) for end in ends))
            if chords is None:
                return []
            s = chords.straightened(s, r)
        projection = _projection(points, s, r, grid)
        if straighten:
            at = np.stack(_coordinates(face, projection.rows @ discretisation.positions))
            projection = replace(projection, at=at)
        found.append(projection)
    return found


def _projection(points: FacePoints, s: NDArray[np.float64], r: NDArray[np.float64], grid: Grid) -> _Projection:
    """The projection of one face on polynomials in s and r (q,)."""
    polynomials, at = _lagrange_at_gauss_points(s, r, points.area, grid)
    weight = polynomials @ points.area
    products = (polynomials * points.area) @ polynomials.T
    oblique = float(np.abs(products - np.diag(weight)).max() / weight.max()) if weight.min() > 0.0 else np.inf
    # a sparse product keeps the columns of other nodes out
    rows = _sparse(polynomials * points.area / weight[:, None]) @ points.interpolation
    return _Projection(rows.tocsr(), points, at, weight, oblique)


def _surface(sector: SectorMesh, side: str) -> ElementSides:
    """The sides of elements on the face of a side."""
    name = f"face_{side}"
    return sector.surfaces[name] if name in sector.surfaces else sides_on(sector.blocks, sector.node_sets[name])


def coarser_mortar(fine: Grid, coarse: Grid) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Contact dofs of a coarser mortar (n_c,) from those of a fine one (m_c,), as E (n_c, m_c), and shares (n_c,).

    The projection on polynomials of lower degree is that of the projection on those of higher degree. For a
    rectangle; no direction of `coarse` has more points than `fine`.
    """
    along, radial = (_restriction(m, n) for m, n in zip(fine, coarse, strict=True))
    return np.asarray(np.kron(radial[0], along[0])), np.asarray(np.kron(radial[1], along[1]))


def _restriction(fine: int, coarse: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """E (n, m) and shares (n,) of one direction: int psi_k u ds / w_k by the Gauss rule of the fine mortar."""
    (points, weights), (nodes, shares) = (np.polynomial.legendre.leggauss(n) for n in (fine, coarse))
    return _lagrange(nodes, points) * weights / shares[:, None], shares / 2.0


def _coordinates(face: ContactFace, position: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return face_coordinates(face.position, face.frame, position)


def face_coordinates(nodes: Array, frame: Array, position: Array) -> tuple[Array, Array]:
    """Coordinates s (q,) along t1 and r (q,) along the radius of points (q, 3) on a face, m.

    `nodes` (n_c, 3), `frame` (n_c, 3, 3): its contact nodes and their rows t1, t2, n.
    The face is unrolled onto the tangent plane at its centre: the circumferential coordinate is an arc. r leads along
    t2 where the face is nearly tangential to the ring.
    """
    centre, t1 = nodes.mean(axis=0), frame[:, 0].mean(axis=0)
    angle, radius = np.arctan2(centre[1], centre[2]), np.hypot(centre[1], centre[2])
    circumferential = t1[1] * np.cos(angle) - t1[2] * np.sin(angle)
    arc = radius * (np.arctan2(position[:, 1], position[:, 2]) - angle)
    t2 = frame[:, 1].mean(axis=0)
    if abs(t2[1] * np.sin(angle) + t2[2] * np.cos(angle)) < _TANGENTIAL:
        return (position - centre) @ t1, (position - centre) @ t2
    return t1[0] * (position[:, 0] - centre[0]) + circumferential * arc, np.hypot(
        position[:, 1], position[:, 2]
    ) - radius


def _lagrange_at_gauss_points(
    s: NDArray[np.float64], r: NDArray[np.float64], area: NDArray[np.float64], grid: Grid
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """psi_k (n_c, q) at quadrature points with coordinates s, r (q,), and s, r (2, n_c) of the contact nodes."""
    along, radial = gauss_points(s, area, grid[0]), gauss_points(r, area, grid[1])
    product = _lagrange(radial, r)[:, None] * _lagrange(along, s)[None]
    at = np.stack([np.tile(along, len(radial)), np.repeat(radial, len(along))])
    return product.reshape(len(radial) * len(along), -1), at


def gauss_points(x: NDArray[np.float64], weight: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Gauss points (count,) of a discrete measure: points x (q,) with weights (q,).

    They are the eigenvalues of the Jacobi matrix that the Lanczos process gives for diag(x).
    """
    from scipy.linalg import eigvalsh_tridiagonal

    vectors = [np.sqrt(weight / weight.sum())]
    diagonal, beside = [], []
    for _ in range(count):
        product = x * vectors[-1]
        diagonal.append(float(vectors[-1] @ product))
        for _ in range(2):  # orthogonal to round-off
            for vector in vectors:
                product = product - (vector @ product) * vector
        beside.append(float(np.linalg.norm(product)))
        vectors.append(product / beside[-1])
    return np.asarray(eigvalsh_tridiagonal(np.array(diagonal), np.array(beside[:-1])))


def _lagrange(nodes: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Lagrange polynomials of nodes (n,) at x (q,): (n, q)."""
    values = np.ones((len(nodes), len(x)))
    for k, node in enumerate(nodes):
        for other in np.delete(nodes, k):
            values[k] *= (x - other) / (node - other)
    return values


def _frames(face: ContactFace, at: NDArray[np.float64]) -> NDArray[np.float64]:
    """Contact frames (n_c, 3, 3) at coordinates s, r (2, n_c), from those of the face's nodes.

    On the faces of our own blades they turn with s only; on others with r too.
    """
    known = np.stack(_coordinates(face, face.position))
    entries = face.frame.reshape(known.shape[1], 9)
    distinct = len(np.unique(np.round(known[0] / (np.ptp(known[0]) or 1.0), 6)))
    fit = np.polynomial.polynomial.polyfit(known[0], entries, min(_CURVATURE, distinct - 1))
    found = np.polynomial.polynomial.polyval(at[0], fit).T
    if np.abs(np.polynomial.polynomial.polyval(known[0], fit).T - entries).max() > _TURNED:
        scale = np.abs(known).max()
        found = _quadratic(at / scale) @ np.linalg.lstsq(_quadratic(known / scale), entries, rcond=_TURNED)[0]
    return orthonormal(np.eye(at.shape[1]), found.reshape(-1, 3, 3))


def orthonormal(weights: NDArray[Any], frames: Array) -> Array:
    """Weighted sums (n, 3, 3) of frames (m, 3, 3), made orthonormal; `weights` (n, m)."""
    left, _, right = np.linalg.svd(np.tensordot(weights, frames, axes=1))
    return np.asarray(left @ right)


def _quadratic(at: NDArray[np.float64]) -> NDArray[np.float64]:
    """1, s, r, s^2, s r, r^2 (k, 6) at coordinates (2, k)."""
    s, r = at
    return np.stack([np.ones_like(s), s, r, s * s, s * r, r * r], axis=1)


def _element_rule(degree: int) -> Rule:
    """Gauss points (p,) and weights (p,) on [0, 1], exact for a psi_k times a quadratic shape function."""
    point, weight = np.polynomial.legendre.leggauss(degree + 1)
    return 0.5 + 0.5 * point, 0.5 * weight


def _sparse(matrix: NDArray[np.float64]) -> csr_matrix:
    from scipy.sparse import csr_matrix

    return csr_matrix(matrix)
