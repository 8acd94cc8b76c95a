"""Elements on their reference cell: shape functions of the displacement and of the geometry, quadrature, sides.

An element of the mesh is isoparametric: its geometry has the same nodes and shape functions as its displacement. A
promoted element has the straight-edged geometry of the eight corners (trilinear) and more nodes for the displacement.

The reference cells are the unit tetrahedron, the unit wedge and the unit cube. scikit-fem supplies all shape
functions but those of the 15-node wedge. There, with the area coordinates L_i of the triangle and
t in [0, 1] along the axis,

    corners at t = 0: L_i (1 - t) (2 L_i - 1 - 2 t),    corners at t = 1: L_i t (2 L_i - 3 + 2 t),
    mid-sides of the triangles: 4 L_i L_j (1 - t) and 4 L_i L_j t,    mid-sides along the axis: 4 L_i t (1 - t).

The quadrature: the stiffness of straight-sided tetrahedra and of parallelepipeds, the mass properties of a rigid
motion, and constant strain in any shape are integrated exactly. For the mass of the quadratic tetrahedron and wedge
it is the order that their rate of convergence needs, degree 2k - 2 for shape functions of degree k [1]_, and the one
of CalculiX.

References
----------
O. C. Zienkiewicz, R. L. Taylor, J. Z. Zhu, The Finite Element Method: Its Basis and Fundamentals, 7th ed.,
Butterworth-Heinemann (2013), section 6.2 (serendipity prisms).
.. [1] G. Strang, G. J. Fix, An Analysis of the Finite Element Method, Prentice-Hall (1973), chapters 4 and 6.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from geometry.elements import ELEMENT_KINDS

Array = NDArray[np.float64]
# Corners of the reference cells in VTK's order, by number of corners.
_CORNERS = {
    4: ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)),
    6: ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)),
    8: ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)),
}
Rule = tuple[NDArray[np.float64], NDArray[np.float64]]  # points (3, q) and weights (q,)
# Sides of the cube in the order of the axes and their ends, as sides of `ELEMENT_KINDS`.
_CUBE_SIDES = (5, 3, 2, 4, 0, 1)


def reference_nodes(kind: str) -> Array:
    """Nodes (b, 3) of an element of a mesh on its reference cell, in VTK's order."""
    topology = ELEMENT_KINDS[kind]
    corners = np.array(_CORNERS[topology.corners], dtype=float)
    if not topology.quadratic:
        return corners
    return np.vstack([corners, corners[np.array(topology.edges)].mean(axis=1)])


def shape_functions(element: str, points: Array) -> tuple[Array, Array]:
    """Values (q, b) and gradients (q, b, 3) of the b shape functions at points (3, q), in the order of scikit-fem.

    The element is a kind of the mesh, or "hex27". The order of the 15-node wedge is VTK's.
    """
    if element == "wedge15":
        return _wedge15(points)
    found = _skfem_element(element)
    table = [found.lbasis(points, i) for i in range(found.doflocs.shape[0])]
    values = np.stack([np.broadcast_to(value, points.shape[1]) for value, _ in table], axis=1)
    gradients = np.stack([np.broadcast_to(gradient, points.shape).T for _, gradient in table], axis=1)
    return np.ascontiguousarray(values), np.ascontiguousarray(gradients)


def vtk_shape_functions(kind: str, points: Array) -> tuple[Array, Array]:
    """`shape_functions` of a kind of element of the mesh, in VTK's order."""
    order = _vtk_order(kind)
    values, gradients = shape_functions(kind, points)
    return np.ascontiguousarray(values[:, order]), np.ascontiguousarray(gradients[:, order])


def node_locations(element: str) -> Array:
    """Nodes (b, 3) on the reference cell in the order of `shape_functions`."""
    return reference_nodes(element) if element == "wedge15" else np.asarray(_skfem_element(element).doflocs)


@cache
def _vtk_order(kind: str) -> tuple[int, ...]:
    """Rows of `node_locations` in VTK's order."""
    distance = np.abs(reference_nodes(kind)[:, None] - node_locations(kind)[None]).sum(axis=-1)
    return tuple(int(k) for k in distance.argmin(axis=1))


def _wedge15(points: Array) -> tuple[Array, Array]:
    r, s, t = points
    zero, one = np.zeros_like(r), np.ones_like(r)
    area = (1.0 - r - s, r, s)
    slope = tuple(np.stack([np.full_like(r, c) for c in rows]) for rows in ((-1, -1, 0), (1, 0, 0), (0, 1, 0)))
    axis = np.stack([zero, zero, one])
    terms = []
    for end, slope_end in ((1.0 - t, -axis), (t, axis)):
        for at, along in zip(area, slope, strict=True):
            inner = 2.0 * at + 2.0 * end - 3.0
            terms.append(
                (
                    at * end * inner,
                    along * end * inner + at * slope_end * inner + at * end * 2.0 * (along + slope_end),
                )
            )
    for end, slope_end in ((1.0 - t, -axis), (t, axis)):
        for i, j in ((0, 1), (1, 2), (2, 0)):
            product, derivative = area[i] * area[j], slope[i] * area[j] + area[i] * slope[j]
            terms.append((4.0 * product * end, 4.0 * (derivative * end + product * slope_end)))
    for at, along in zip(area, slope, strict=True):
        terms.append((4.0 * at * t * (1.0 - t), 4.0 * (along * t * (1.0 - t) + at * (1.0 - 2.0 * t) * axis)))
    return np.stack([value for value, _ in terms], axis=1), np.stack([gradient.T for _, gradient in terms], axis=1)


@cache
def _skfem_element(element: str) -> Any:
    import skfem

    names = {
        "tet4": "ElementTetP1",
        "tet10": "ElementTetP2",
        "wedge6": "ElementWedge1",
        "hex8": "ElementHex1",
        "hex20": "ElementHexS2",
        "hex27": "ElementHex2",
    }
    return getattr(skfem, names[element])()


def volume_rule(element: str) -> Rule:
    """Points (3, q) and weights (q,): 8 or 27 in a hexahedron, 4 in a tetrahedron, 6 or 9 in a wedge."""
    from skfem.quadrature import get_quadrature
    from skfem.refdom import RefHex, RefTet, RefTri

    if element.startswith("hex"):
        points, weights = get_quadrature(RefHex, 3 if element == "hex8" else 5)
        return points, weights
    if element.startswith("tet"):
        points, weights = get_quadrature(RefTet, 2)
        return points, weights
    triangle, area = get_quadrature(RefTri, 2)
    line, length = np.polynomial.legendre.leggauss(2 if element == "wedge6" else 3)
    points = np.vstack([np.repeat(triangle, len(line), axis=1), np.tile(0.5 + 0.5 * line, len(area))])
    return points, np.outer(area, 0.5 * length).ravel()


@dataclass(frozen=True)
class ShapeTable:
    """Shape functions at the q points of a quadrature rule, for b displacement nodes and g geometry nodes."""

    values: Array  # (q, b), shape functions of the displacement
    gradients: Array  # (q, 3, b), their gradients on the reference cell
    geometry: Array  # (q, g), shape functions of the geometry
    geometry_gradients: Array  # (q, g, 3), their gradients on the reference cell
    weights: Array  # (q,), quadrature weights


@dataclass(frozen=True)
class ReferenceSide:
    """A side of the reference cell: the points origin + x u + y v, 0 <= x, y <= 1, of a triangle x + y <= 1."""

    side: int  # number of the side in `ElementKind.sides`
    # `origin`, `u`, `v`: (3,), the parametrisation
    origin: Array
    u: Array
    v: Array
    outward: float  # 1 where u x v points out of the cell, -1 where it points inwards
    triangle: bool  # whether the side is a triangle

    def at(self, x: Array, y: Array) -> Array:
        """Points (3, q) of the reference cell at parameters (q,)."""
        return self.origin[:, None] + self.u[:, None] * x + self.v[:, None] * y


@dataclass(frozen=True)
class ReferenceElement:
    """An element on its reference cell."""

    element: str  # A kind of the mesh, or "hex27"
    kind: str  # kind of the element of the mesh that it stands on
    promoted: bool  # whether its geometry is that of the corners alone

    def shape_functions(self, points: Array) -> tuple[Array, Array]:
        """Values (q, b) and gradients (q, b, 3) of the displacement's shape functions at points (3, q)."""
        return (shape_functions if self.promoted else vtk_shape_functions)(self.element, points)

    def geometry_functions(self, points: Array) -> tuple[Array, Array]:
        """Values (q, g) and gradients (q, g, 3) of the shape functions of the geometry at points (3, q)."""
        return shape_functions("hex8", points) if self.promoted else self.shape_functions(points)

    @property
    def nodes(self) -> Array:
        """Nodes (b, 3) of the displacement on the reference cell."""
        return node_locations(self.element) if self.promoted else reference_nodes(self.kind)

    def table(self) -> ShapeTable:
        """Shape functions at the quadrature points."""
        points, weights = volume_rule(self.element)
        values, gradients = self.shape_functions(points)
        geometry, geometry_gradients = self.geometry_functions(points)
        return ShapeTable(
            values, np.ascontiguousarray(gradients.transpose(0, 2, 1)), geometry, geometry_gradients, weights
        )


@cache
def reference_sides(kind: str) -> tuple[ReferenceSide, ...]:
    """The sides of a kind of element; those of the cube in the order of the axes, at 0 and at 1."""
    topology, cell = ELEMENT_KINDS[kind], reference_nodes(kind)
    corners, centre = cell[: topology.corners], cell[: topology.corners].mean(axis=0)
    found = []
    for side in _CUBE_SIDES if topology.corners == 8 else range(len(topology.sides)):
        loop = corners[list(topology.sides[side])]
        if topology.corners == 8:  # parameters along the axes
            origin = loop.min(axis=0)
            u, v = np.eye(3)[np.ptp(loop, axis=0) > 0.0]
        else:
            origin, u, v = loop[0], loop[1] - loop[0], loop[-1] - loop[0]
        outward = float(np.sign(np.cross(u, v) @ (loop.mean(axis=0) - centre)))
        found.append(ReferenceSide(side, origin, u, v, outward, len(loop) == 3))
    return tuple(found)
