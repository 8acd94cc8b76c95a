"""Axes of the program in those of a file: x along the engine, z through the contact faces, y circumferential."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from geometry.sector import FloatArray

_ROUND_OFF = 1e-9

NAMED_AXES: Mapping[str, FloatArray] = MappingProxyType(
    {
        sign + name: factor * row
        for name, row in zip("xyz", np.eye(3), strict=True)
        for sign, factor in (("", 1.0), ("-", -1.0))
    }
)


def axes_through(direction: FloatArray, at: FloatArray) -> FloatArray:
    """Rotation matrix, rows x, y, z, for an engine axis through the origin and a point off it.

    Parameters
    ----------
    direction : (3,) array
        Engine axis, of length 1.
    at : (3,) array
        Point that z leads through.

    Returns
    -------
    (3, 3) array
        The rotation; entries that are 0, 1 or -1 to round-off are exact, so that a mesh in our axes stays as it is.

    Examples
    --------
    >>> from geometry import NAMED_AXES, axes_through
    >>> axes_through(NAMED_AXES["z"], np.array([0.3, 0.0, 0.1])).tolist()
    [[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]]
    """
    radial = at - (at @ direction) * direction
    z = radial / np.linalg.norm(radial)
    rotation = np.stack([direction, np.cross(z, direction), z])
    exact = np.round(rotation)
    return exact + 0.0 if np.abs(rotation - exact).max() < _ROUND_OFF else rotation


def distance_from_axis(direction: FloatArray, at: FloatArray) -> FloatArray:
    """Distances (...,) of points (..., 3) from the axis through the origin."""
    return np.linalg.norm(np.cross(at, direction), axis=-1)
