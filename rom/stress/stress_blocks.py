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

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from geometry import ELEMENT_KINDS
from rom.finite_elements.discretisation import DiscreteBlock, Discretisation
from rom.finite_elements.quadrature import volume_rule
from rom.finite_elements.shape_functions import shape_functions, vtk_shape_functions

Array = NDArray[np.float64]
_LINEAR = {4: "tet4", 6: "wedge6", 8: "hex8"}  # by the number of corners


@dataclass(frozen=True)
class StressBlock:
    """E elements of b nodes, all of one kind and material."""

    nodes: NDArray[np.int64]  # (E, b), nodes of each element
    extrapolation: Array  # (b, q), from values at the quadrature points to values at the nodes
    material: str  # name of the material


def stress_blocks(discretisation: Discretisation) -> tuple[StressBlock, ...]:
    """The elements of a discretisation, for the recovery of stresses; as many as it has blocks."""
    return tuple(
        StressBlock(block.nodes, _extrapolation_in(block), block.material) for block in discretisation.blocks
    )


def _extrapolation_in(block: DiscreteBlock) -> Array:
    """From the quadrature points to the nodes of the elements of a block."""
    reference = block.reference
    points, weights = volume_rule(reference.element)
    if reference.promoted:
        (values, _), (shares, _) = shape_functions("hex8", points), shape_functions("hex8", reference.nodes.T)
    else:
        corners = _LINEAR[ELEMENT_KINDS[reference.kind].corners]
        (values, _), (shares, _) = (
            vtk_shape_functions(corners, points),
            vtk_shape_functions(corners, reference.nodes.T),
        )
    return extrapolation(values, weights, shares)


def extrapolation(corner_values: Array, weights: Array, shares: Array) -> Array:
    """Least squares projection on the corner functions, then their values at the nodes.

    Shapes: `corner_values` (q, c), `weights` (q,), `shares` (b, c), returns (b, q).
    """
    root = np.sqrt(weights)
    return np.asarray(shares @ (np.linalg.pinv(root[:, None] * corner_values) * root))
