"""Quadrature of stiffness and mass on the reference cells.

The stiffness of straight-sided tetrahedra and of parallelepipeds, and constant strain in any shape, are integrated
exactly. The mass of a tetrahedron or a wedge has a rule of its own: its integrand has a higher degree.

References
----------
P. Keast, Moderate-degree tetrahedral quadrature formulas, Computer Methods in Applied Mechanics and Engineering
55 (1986) 339-348.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Rule = tuple[NDArray[np.float64], NDArray[np.float64]]  # points (3, q) and weights (q,)


def stiffness_rule(element: str) -> Rule:
    """Points (3, q) and weights (q,) for the stiffness of an element."""
    from skfem.quadrature import get_quadrature
    from skfem.refdom import RefHex, RefTet

    if element.startswith("hex"):
        return _rule(get_quadrature(RefHex, 3 if element == "hex8" else 5))
    if element.startswith("tet"):
        return _rule(get_quadrature(RefTet, 1 if element == "tet4" else 2))
    return _wedge_rule(2, 2 if element == "wedge6" else 3)


def mass_rule(element: str) -> Rule | None:
    """The rule for the mass; None where it is that of the stiffness."""
    if element.startswith("hex"):
        return None
    if element.startswith("tet"):
        return _keast_15()
    return _wedge_rule(4, 3)


def _rule(rule: Rule) -> Rule:
    return rule[0], rule[1]


def _wedge_rule(degree: int, count: int) -> Rule:
    """A rule of a degree on the triangle times `count` Gauss points along the axis."""
    from skfem.quadrature import get_quadrature
    from skfem.refdom import RefTri

    triangle, area = get_quadrature(RefTri, degree)
    line, length = np.polynomial.legendre.leggauss(count)
    points = np.vstack([np.repeat(triangle, count, axis=1), np.tile(0.5 + 0.5 * line, len(area))])
    return points, np.outer(area, 0.5 * length).ravel()


def _keast_15() -> Rule:
    """15 points in the unit tetrahedron, exact to degree 5."""
    points, weights = [np.full((1, 4), 0.25)], [6544.0 / 36015.0 / 6.0]
    for other, weight in ((1.0 / 3.0, 81.0 / 2240.0 / 6.0), (1.0 / 11.0, 161051.0 / 2304960.0 / 6.0)):
        points.append(np.full((4, 4), other) + np.eye(4) * (1.0 - 4.0 * other))
        weights += [weight] * 4
    small = (1.0 - np.sqrt(7.0 / 13.0)) / 4.0
    pairs = [(i, j) for i in range(4) for j in range(i + 1, 4)]
    edges = np.full((6, 4), small)
    for row, (i, j) in enumerate(pairs):
        edges[row, [i, j]] = 0.5 - small
    points.append(edges)
    weights += [338.0 / 5145.0 / 6.0] * 6
    return np.vstack(points)[:, 1:].T.copy(), np.array(weights)
