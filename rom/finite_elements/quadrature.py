"""Quadrature of stiffness and mass on the reference cells.

The stiffness of straight-sided tetrahedra and of parallelepipeds, the mass properties of a rigid motion, and constant
strain in any shape are integrated exactly. For the mass of the quadratic tetrahedron and wedge it is the order that
their rate of convergence needs, degree 2k - 2 for shape functions of degree k [1]_, and the one of CalculiX.

References
----------
.. [1] G. Strang, G. J. Fix, An Analysis of the Finite Element Method, Prentice-Hall (1973), chapters 4 and 6.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Rule = tuple[NDArray[np.float64], NDArray[np.float64]]  # points (3, q) and weights (q,)


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
