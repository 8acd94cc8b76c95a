"""Symmetric stress tensors by their six components xx, yy, zz, xy, yz, zx, the order of VTK."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

ROWS, COLUMNS = (0, 1, 2, 0, 1, 2), (0, 1, 2, 1, 2, 0)
COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "zx")


def components(tensor: NDArray[Any]) -> NDArray[Any]:
    """Six components (..., 6) of symmetric tensors (..., 3, 3)."""
    return tensor[..., ROWS, COLUMNS]


def von_mises(stress: NDArray[Any]) -> NDArray[np.float64]:
    """Von Mises stress of tensors, sqrt(3/2 s:s) with the deviator s.

    Parameters
    ----------
    stress : (..., 6) array
        Components xx, yy, zz, xy, yz, zx. Of complex amplitudes the Hermitian norm sqrt(3/2 s:s*) is taken, which is
        at least the amplitude of the cycle and equal to it where the components are in phase.

    Returns
    -------
    (...) array
        Von Mises stress, in the unit of the components.

    Examples
    --------
    Tension, and pure shear:

    >>> from rom import von_mises
    >>> von_mises(np.array([[5.0, 0, 0, 0, 0, 0], [0, 0, 0, 1.0, 0, 0]])).round(6).tolist()
    [5.0, 1.732051]
    """
    return np.linalg.norm(deviator(stress), axis=-1)


def deviator(stress: NDArray[Any]) -> NDArray[Any]:
    """Coordinates (..., 5) of the deviators of tensors (..., 6) whose Euclidean norm is the von Mises stress."""
    xx, yy, zz = stress[..., 0], stress[..., 1], stress[..., 2]
    shear = np.sqrt(3.0) * stress[..., 3:]
    normal = np.stack([xx - 0.5 * (yy + zz), np.sqrt(0.75) * (yy - zz)], axis=-1)
    return np.concatenate([normal, shear], axis=-1)
