"""Cauchy stress of a displacement gradient, and its increment in a further small displacement.

With F = I + H and the second Piola-Kirchhoff stress S of the Green-Lagrange strain (St. Venant-Kirchhoff) the Cauchy
stress is F S F^T / det F. Its derivative in the direction of dF is, with L = dF F^-1 and dS = C : sym(F^T dF),

    d sigma = L sigma + sigma L^T - tr(L) sigma + F dS F^T / det F.

References
----------
K. J. Bathe, Finite Element Procedures, Prentice Hall (1996), section 6.2.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rom.finite_elements.material import Material

Array = NDArray[np.float64]


def cauchy_stress(material: Material, gradient: Array) -> Array:
    """Cauchy stress (..., 3, 3), Pa, of a displacement gradient (..., 3, 3), H_ij = du_i / dX_j, of any size."""
    deformation = np.eye(3) + gradient
    strain = 0.5 * (_transposed(deformation) @ deformation - np.eye(3))
    pushed = deformation @ material.stress(strain) @ _transposed(deformation)
    return pushed / np.linalg.det(deformation)[..., None, None]


def cauchy_increment(material: Material, gradient: Array, increment: NDArray[Any]) -> NDArray[Any]:
    """Increment (k, ..., 3, 3) of the Cauchy stress for small further gradients (k, ..., 3, 3), real or complex."""
    deformation = np.eye(3) + gradient
    stress = cauchy_stress(material, gradient)
    velocity = increment @ np.linalg.inv(deformation)
    mixed = _transposed(deformation) @ increment
    inner = material.stress(0.5 * (mixed + _transposed(mixed)))
    pushed = deformation @ inner @ _transposed(deformation) / np.linalg.det(deformation)[..., None, None]
    turned = velocity @ stress
    trace = np.trace(velocity, axis1=-2, axis2=-1)[..., None, None]
    return turned + _transposed(turned) - trace * stress + pushed


def _transposed(tensor: NDArray[Any]) -> NDArray[Any]:
    return tensor.swapaxes(-1, -2)
