"""Elements of one kind and material as the recovery of stresses sees them: nodes, gradients, extrapolation.

In each element the stress at the quadrature points is projected (least squares with the quadrature weights) on the
linear shape functions of the corners; a mid-side node gets the mean of the corners between which it lies. On a line
that projection of a quadratic takes its values at the two Gauss points, where the strains of quadratic elements are
one order more accurate than elsewhere (Barlow): values at the nodes themselves are the worst of an element.

References
----------
J. Barlow, Optimal stress locations in finite element models, Int. J. Numer. Methods Eng. 10 (1976) 243.
E. Hinton, J. S. Campbell, Local and global smoothing of discontinuous finite element functions using a least squares
method, Int. J. Numer. Methods Eng. 8 (1974) 461.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rom.finite_elements.discretisation import Discretisation, shape_functions

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StressBlock:
    """E elements of b nodes, all of one kind and material.

    Attributes
    ----------
    nodes : (E, b) array
        Nodes of each element.
    extrapolation : (b, q) array
        From values at the quadrature points to values at the nodes.
    material : str
        Name of the material.
    discretisation : Discretisation
        Where the gradients come from.
    """

    nodes: NDArray[np.int64]
    extrapolation: Array
    material: str
    discretisation: Discretisation

    def batches(self) -> Iterator[tuple[slice, Array]]:
        """Yield (elements, gradients (e, q, 3, b) [1/m]) for bounded batches of elements."""
        for part, gradients, _ in self.discretisation.batches():
            yield part, gradients


def stress_blocks(discretisation: Discretisation) -> tuple[StressBlock, ...]:
    """The elements of a discretisation, for the recovery of stresses."""
    from skfem.quadrature import get_quadrature
    from skfem.refdom import RefHex

    points, _ = get_quadrature(RefHex, 3 if discretisation.element == "hex8" else 5)
    corners, _ = shape_functions("hex8", points)
    matrix = extrapolation(corners, discretisation.weights, discretisation.support)
    return (StressBlock(discretisation.element_nodes, matrix, "", discretisation),)


def extrapolation(corner_values: Array, weights: Array, support: NDArray[np.bool_]) -> Array:
    """Least squares projection on the corner functions, then their means at the nodes.

    Parameters
    ----------
    corner_values : (q, c) array
        Linear shape functions of the c corners at the quadrature points.
    weights : (q,) array
        Quadrature weights.
    support : (b, c) array of bool
        The corners between which each node lies.

    Returns
    -------
    (b, q) array
        With too few quadrature points for a linear field, the smallest corner values that fit.
    """
    root = np.sqrt(np.abs(weights))
    at_corners = np.linalg.pinv(root[:, None] * corner_values) * root
    shares = support / support.sum(axis=1, keepdims=True)
    return shares @ at_corners
