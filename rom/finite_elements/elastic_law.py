"""The elastic law of some elements: constants, or values at their quadrature points.

Strains and stresses are vectors of six components in the order xx, yy, zz, yz, zx, xy where the law is a matrix
(Voigt), with the shear angles 2 eps in the strain.

References
----------
J. F. Nye, Physical Properties of Crystals, Oxford University Press (1985), chapter 8.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Values = float | Array
# Tensor components of the six, and the six that each tensor component is.
ROWS, COLUMNS = np.array([0, 1, 2, 1, 2, 0]), np.array([0, 1, 2, 2, 0, 1])
SIX = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])
ANGLES = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])


@dataclass(frozen=True)
class ElasticLaw:
    """Values are those of all elements, or those at each quadrature point of some, (e, q) or (e, q, ...)."""

    density: Values  # kg/m^3
    # `lame`, `shear`: Lame's constants of an isotropic law, Pa
    lame: Values = 0.0
    shear: Values = 0.0
    stiffness: Array | None = None  # (..., 6, 6) in the axes of the mesh, Pa; None: isotropic
    expansion: Array | float = 0.0  # of a kelvin, 1/K, or (3, 3) in the axes of the mesh
    strain: Array | float | None = None  # thermal strain (...) or (..., 3, 3) of the temperatures; None: not given

    def stress(self, strain: NDArray[Any]) -> NDArray[Any]:
        """Stress (..., 3, 3), Pa, of strains: small ones, or Green-Lagrange for the second Piola-Kirchhoff stress."""
        if self.stiffness is not None:
            six = strain[..., ROWS, COLUMNS] * ANGLES
            return np.asarray((self.stiffness @ six[..., None])[..., 0])[..., SIX]
        volumetric = self.lame * np.trace(strain, axis1=-2, axis2=-1)
        return np.asarray(2 * _of_tensor(self.shear) * strain + volumetric[..., None, None] * np.eye(3))

    def restrained_stress(self, rise: Array) -> Array:
        """Stress (e, q, 3, 3), Pa, that the free expansion is times the law: of a heated body that cannot expand.

        `rise` (e, q): temperature above the stress-free one, K, where the law does not hold the thermal strain.
        """
        strain = np.asarray(self.expansion) if self.strain is None else np.asarray(self.strain)
        tensor = strain if strain.shape[-2:] == (3, 3) else strain[..., None, None] * np.eye(3)
        if self.strain is None:
            tensor = rise[..., None, None] * tensor
        return np.broadcast_to(self.stress(tensor), (*rise.shape, 3, 3))


def _of_tensor(values: Values) -> Values:
    return values if isinstance(values, float) else values[..., None, None]


def strain_rows(gradients: Array, deformation: Array | None = None) -> Array:
    """Strains (e, q, 6, 3 b) of the displacements of the nodes, component by component: F^T grad, symmetric.

    Shapes: `gradients` (e, q, 3, b), `deformation` (e, q, 3, 3), the deformation gradient F; None: small strains.
    """
    elements, points, _, nodes = gradients.shape
    turned = np.eye(3)[None, None] if deformation is None else deformation
    # d E_MN = F_iM g_N du_i, in both orders
    rows = np.zeros((elements, points, 6, 3, nodes))
    for six, (m, n) in enumerate(zip(ROWS, COLUMNS, strict=True)):
        rows[:, :, six] = turned[..., m, None] * gradients[:, :, None, n]
        if m != n:
            rows[:, :, six] += turned[..., n, None] * gradients[:, :, None, m]
    return rows.reshape(elements, points, 6, 3 * nodes)
