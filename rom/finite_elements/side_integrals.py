"""Quadrature points on sides of elements, triangles and quadrilaterals, flat or curved."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from geometry import ElementSides
from rom.finite_elements.discretisation import DiscreteBlock, Discretisation
from rom.finite_elements.reference_element import ReferenceSide, reference_sides

Array = NDArray[np.float64]
Rule = tuple[Array, Array]


@dataclass(frozen=True)
class SidePoints:
    """q quadrature points on the same side of s elements of one block."""

    position: Array  # (s, q, 3), points, m
    normal: Array  # (s, q, 3), outward normals, not of unit length: times the weights they are the area vectors, m^2
    weights: Array  # (q,), quadrature weights
    # (s, b), nodes of the elements, and rows of the points of the mesh that give their geometry
    nodes: NDArray[np.int64]
    # (s, b), nodes of the elements, and rows of the points of the mesh that give their geometry
    vertices: NDArray[np.int64]
    values: Array  # (q, b), shape functions of the displacement and of the geometry
    geometry: Array  # (q, b), shape functions of the displacement and of the geometry

    @property
    def area(self) -> Array:
        """Shares (s, q) of the area, m^2."""
        return np.asarray(self.weights * np.linalg.norm(self.normal, axis=-1))


def points_on_sides(discretisation: Discretisation, sides: ElementSides, rule: Rule) -> Iterator[SidePoints]:
    """Quadrature points on a surface, one side of the reference cell after the other.

    The rule, points (p,) and weights (p,) on [0, 1], is applied in both directions of a quadrilateral. On a triangle
    it is applied to the square that is collapsed on it (Duffy): exact for one degree less.
    """
    for index, block in enumerate(discretisation.blocks):
        for side in reference_sides(block.reference.kind):
            elements = sides.element[(sides.block == index) & (sides.side == side.side)]
            if len(elements):
                yield _on_side(block, side, elements, rule)


def _on_side(block: DiscreteBlock, side: ReferenceSide, elements: NDArray[np.int64], rule: Rule) -> SidePoints:
    """Points on one side of the reference cell of some elements (s,)."""
    line, weight = rule
    x, y = (grid.ravel() for grid in np.meshgrid(line, line, indexing="ij"))
    weights = np.outer(weight, weight).ravel()
    if side.triangle:
        y, weights = y * (1.0 - x), weights * (1.0 - x)
    points = side.at(x, y)
    values, _ = block.reference.shape_functions(points)
    geometry, slopes = block.reference.geometry_functions(points)
    corners = block.geometry[elements]
    first, second = (np.einsum("qc,eci->eqi", slopes @ along, corners) for along in (side.u, side.v))
    return SidePoints(
        position=np.einsum("qc,eci->eqi", geometry, corners),
        normal=side.outward * np.cross(first, second),
        weights=weights,
        nodes=block.nodes[elements],
        vertices=block.vertices[elements],
        values=values,
        geometry=geometry,
    )
