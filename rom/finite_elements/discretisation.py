"""Nodes, connectivity and shape functions of a hexahedral mesh for the elements hex8, hex20 and hex27.

The geometry is first order (eight corners, trilinear). scikit-fem numbers the higher-order nodes and supplies the
shape functions and the quadrature.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rom.errors import RomParameterError

ELEMENTS = ("hex20", "hex8", "hex27")

# Corner k of scikit-fem's reference hexahedron is corner VTK_CORNER[k] of VTK's and gmsh's.
_VTK_CORNER = (6, 2, 5, 7, 1, 3, 4, 0)
# Corners of the reference cube, (8, 3), in scikit-fem's order.
REFERENCE_CORNERS = ((1, 1, 1), (1, 1, 0), (1, 0, 1), (0, 1, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, 0))
# Doubles in one batch of elements (about 64 MB).
_BATCH_DOUBLES = 8_000_000


@dataclass(frozen=True)
class Discretisation:
    """Nodes and shape functions for the integrals: E elements of b nodes, n nodes in all, q quadrature points.

    Attributes
    ----------
    element : str
        Name of the element.
    positions : (n, 3) array
        Nodes, m.
    element_nodes : (E, b) array
        Nodes of each element.
    vertex_node : (V,) array
        Node of each mesh vertex.
    corners : (E, 8, 3) array
        Corners of each element, m.
    values : (q, b) array
        Shape functions at the quadrature points.
    gradients : (q, 3, b) array
        Their gradients on the reference cube.
    corner_gradients : (q, 8, 3) array
        Gradients of the trilinear shape functions of the geometry.
    weights : (q,) array
        Quadrature weights.
    support : (b, 8) bool array
        The corners between which each node of an element lies.
    """

    element: str
    positions: NDArray[np.float64]
    element_nodes: NDArray[np.int64]
    vertex_node: NDArray[np.int64]
    corners: NDArray[np.float64]
    values: NDArray[np.float64]
    gradients: NDArray[np.float64]
    corner_gradients: NDArray[np.float64]
    weights: NDArray[np.float64]
    support: NDArray[np.bool_]

    @property
    def n_nodes(self) -> int:
        """Number of nodes, mid-side nodes included."""
        return len(self.positions)

    def nodes_on(self, vertices: NDArray[np.integer[Any]]) -> NDArray[np.int64]:
        """Sorted nodes on or between the given mesh vertices (edge and face nodes of a clamped surface)."""
        chosen = np.zeros(self.n_nodes, dtype=bool)
        chosen[self.vertex_node[vertices]] = True
        corner_chosen = chosen[self.element_nodes[:, self.support.sum(axis=1) == 1]]
        # A node belongs to the set when no corner that supports it is outside.
        inside = (~corner_chosen).astype(np.int64) @ self.support.T == 0
        return np.unique(self.element_nodes[inside])

    def batches(self) -> Iterator[tuple[slice, NDArray[np.float64], NDArray[np.float64]]]:
        """Yield (elements, gradients (e, q, 3, b) [1/m], weights (e, q) [m^3]) for bounded batches of elements.

        Raises RomParameterError when an element is turned inside out.
        """
        n_elements, nodes = self.element_nodes.shape
        size = max(1, _BATCH_DOUBLES // (2 * (3 * nodes) ** 2))
        for first in range(0, n_elements, size):
            part = slice(first, min(first + size, n_elements))
            jacobian = np.einsum("eci,qcj->eqij", self.corners[part], self.corner_gradients, optimize=True)
            determinant = np.linalg.det(jacobian)
            if determinant.min() <= 0.0:
                worst = first + int(np.argmin(determinant.min(axis=1)))
                raise RomParameterError(
                    "mesh", "hexahedra", worst, "this element is turned inside out (Jacobian not above 0)"
                )
            inverse_transposed = np.linalg.inv(jacobian).transpose(0, 1, 3, 2)
            yield part, inverse_transposed @ self.gradients, determinant * self.weights


def discretise(
    points: NDArray[np.float64], hexahedra: NDArray[np.integer[Any]], element: str = "hex20"
) -> Discretisation:
    """Place the nodes of an element on a mesh of points (V, 3) in m and hexahedra (E, 8) in VTK node order.

    The quadrature has 3 x 3 x 3 Gauss points (order 5) for the quadratic elements and 2 x 2 x 2 for hex8: exact for
    the stiffness of parallelepipeds and for constant strain in any shape.
    Raises RomParameterError for an unknown element or a mesh with vertices that no element uses.
    """
    if element not in ELEMENTS:
        raise RomParameterError("mesh", "element", element, f"must be one of {', '.join(ELEMENTS)}")
    unused = np.setdiff1d(np.arange(len(points)), hexahedra)
    if len(unused):
        raise RomParameterError("mesh", "points", int(unused[0]), "this vertex belongs to no element")
    from skfem import Dofs, MeshHex1
    from skfem.quadrature import get_quadrature
    from skfem.refdom import RefHex

    skfem_element = _skfem_element(element)
    corners = np.asarray(hexahedra)[:, _VTK_CORNER]
    mesh = MeshHex1(np.ascontiguousarray(points.T), np.ascontiguousarray(corners.T.astype(np.int32)))
    dofs = Dofs(mesh, skfem_element)
    reference_points, weights = get_quadrature(RefHex, 3 if element == "hex8" else 5)
    values, gradients = shape_functions(element, reference_points)
    _, corner_gradients = shape_functions("hex8", reference_points)
    corner_points = np.asarray(points)[corners]
    element_nodes = np.ascontiguousarray(dofs.element_dofs.T).astype(np.int64)
    geometry, _ = shape_functions("hex8", skfem_element.doflocs.T)
    positions = np.zeros((dofs.N, 3))
    positions[element_nodes] = np.einsum("bc,eci->ebi", geometry, corner_points)
    return Discretisation(
        element=element,
        positions=positions,
        element_nodes=element_nodes,
        vertex_node=dofs.nodal_dofs[0].astype(np.int64),
        corners=corner_points,
        values=values,
        gradients=np.ascontiguousarray(gradients.transpose(0, 2, 1)),
        corner_gradients=corner_gradients,
        weights=weights,
        support=geometry > 1e-12,
    )


def shape_functions(element: str, points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Values (q, b) and gradients (q, b, 3) of the b shape functions of an element.

    The points (3, q) lie in the reference cube. The first eight shape functions belong to the corners
    (`REFERENCE_CORNERS`); those of "hex8" describe the geometry of every element.
    """
    skfem_element = _skfem_element(element)
    table = [skfem_element.lbasis(points, i) for i in range(skfem_element.doflocs.shape[0])]
    values = np.stack([np.broadcast_to(value, points.shape[1]) for value, _ in table], axis=1)
    gradients = np.stack([np.broadcast_to(gradient, points.shape).T for _, gradient in table], axis=1)
    return np.ascontiguousarray(values), np.ascontiguousarray(gradients)


def _skfem_element(element: str) -> Any:
    from skfem import ElementHex1, ElementHex2, ElementHexS2

    return {"hex20": ElementHexS2, "hex8": ElementHex1, "hex27": ElementHex2}[element]()
