"""Elements on their reference cell: shape functions of the displacement and of the geometry, quadrature, sides.

An element of the mesh is isoparametric: its geometry has the same nodes and shape functions as its displacement. A
promoted element has the straight-edged geometry of the eight corners (trilinear) and more nodes for the displacement.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from geometry import ELEMENT_KINDS
from rom.finite_elements.quadrature import volume_rule
from rom.finite_elements.shape_functions import node_locations, reference_nodes, shape_functions, vtk_shape_functions

Array = NDArray[np.float64]

# Sides of the cube in the order of the axes and their ends, as sides of `ELEMENT_KINDS`.
_CUBE_SIDES = (5, 3, 2, 4, 0, 1)


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
    origin: Array  # (3,), the parametrisation
    u: Array  # (3,), the parametrisation
    v: Array  # (3,), the parametrisation
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
