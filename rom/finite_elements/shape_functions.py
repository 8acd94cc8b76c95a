"""Shape functions of the elements on their reference cells: unit tetrahedron, unit wedge, unit cube.

scikit-fem supplies all but those of the 15-node wedge. There, with the area coordinates L_i of the triangle and
t in [0, 1] along the axis,

    corners at t = 0: L_i (1 - t) (2 L_i - 1 - 2 t),    corners at t = 1: L_i t (2 L_i - 3 + 2 t),
    mid-sides of the triangles: 4 L_i L_j (1 - t) and 4 L_i L_j t,    mid-sides along the axis: 4 L_i t (1 - t).

References
----------
O. C. Zienkiewicz, R. L. Taylor, J. Z. Zhu, The Finite Element Method: Its Basis and Fundamentals, 7th ed.,
Butterworth-Heinemann (2013), section 6.2 (serendipity prisms).
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from geometry import ELEMENT_KINDS

Array = NDArray[np.float64]

# Corners of the reference cells in VTK's order, by number of corners.
_CORNERS = {
    4: ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)),
    6: ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)),
    8: ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)),
}


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
