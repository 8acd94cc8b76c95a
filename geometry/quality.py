"""Scaled Jacobian of an element: the smallest over its corners, 1 for a brick, 0 or less for a folded element.

References
----------
P. M. Knupp, Algebraic mesh quality metrics, SIAM J. Sci. Comput. 23 (2001) 193-218.
"""

import numpy as np

from geometry.elements import ElementBlock
from geometry.sector import FloatArray, IntArray

# corner -> its three neighbours, in the order that makes a right-handed triple (VTK hexahedron)
HEXAHEDRON_NEIGHBOURS = np.array(
    [[1, 3, 4], [2, 0, 5], [3, 1, 6], [0, 2, 7], [7, 5, 0], [4, 6, 1], [5, 7, 2], [6, 4, 3]]
)

# corners -> the neighbours of each corner, right-handed, and 1 over the determinant of the regular element
_CORNERS = {
    4: (np.array([[1, 2, 3], [2, 0, 3], [0, 1, 3], [0, 2, 1]]), np.sqrt(2.0)),
    6: (np.array([[1, 2, 3], [2, 0, 4], [0, 1, 5], [5, 4, 0], [3, 5, 1], [4, 3, 2]]), np.sqrt(4.0 / 3.0)),
}


def hexahedron_scaled_jacobian(points: FloatArray, hexahedra: IntArray) -> FloatArray:
    """Scaled Jacobian of hexahedra, the smallest over the corners.

    `points` (N, 3): vertices; `hexahedra` (E, 8): elements in VTK node order. Returns (E,): scaled Jacobian of each
    element.
    """
    corners = points[hexahedra]
    edges = corners[:, HEXAHEDRON_NEIGHBOURS] - corners[:, :, None, :]
    edges /= np.linalg.norm(edges, axis=-1, keepdims=True)
    return np.linalg.det(edges).min(axis=1)


def scaled_jacobian(points: FloatArray, block: ElementBlock) -> FloatArray:
    """Scaled Jacobian of elements of any kind, the smallest over the corners; straight edges between the corners.

    `points` (N, 3): nodes. Returns (E,): scaled Jacobian of each element, 1 for a cube, a regular tetrahedron, a
    right prism on a regular triangle.
    """
    kind = block.topology
    if kind.corners == 8:
        return hexahedron_scaled_jacobian(points, block.nodes[:, :8])
    triples, regular = _CORNERS[kind.corners]
    corners = points[block.nodes[:, : kind.corners]]
    edges = corners[:, triples] - corners[:, :, None, :]
    edges /= np.linalg.norm(edges, axis=-1, keepdims=True)
    return np.asarray(np.linalg.det(edges).min(axis=1) * regular)


def quadrilateral_scaled_jacobian(points: FloatArray, quads: IntArray) -> FloatArray:
    """Scaled Jacobian (Q,) of plane quadrilaterals, from ``points`` (N, 2) and ``quads`` (Q, 4)."""
    corners = points[quads]
    ahead = np.roll(corners, -1, axis=1) - corners
    behind = np.roll(corners, 1, axis=1) - corners
    cross = ahead[..., 0] * behind[..., 1] - ahead[..., 1] * behind[..., 0]
    length = np.linalg.norm(ahead, axis=-1) * np.linalg.norm(behind, axis=-1)
    return (cross / length).min(axis=1)
