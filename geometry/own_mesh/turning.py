"""Turning a mesh to our axes: x the engine axis, z radial through the contact faces, y circumferential."""

from __future__ import annotations

import numpy as np

from geometry.sector import FloatArray

_ROUND_OFF = 1e-9


def axes_through(direction: FloatArray, at: FloatArray) -> FloatArray:
    """Rotation matrix (3, 3), rows x, y, z, for an engine axis `direction` and a point `at` (3,) off the axis.

    The identity to round-off is the identity, so that a mesh in our axes stays as it is.
    """
    radial = at - (at @ direction) * direction
    z = radial / np.linalg.norm(radial)
    rotation = np.stack([direction, np.cross(z, direction), z])
    return np.eye(3) if np.abs(rotation - np.eye(3)).max() < _ROUND_OFF else rotation


def distance_from_axis(direction: FloatArray, at: FloatArray) -> FloatArray:
    """Distances (...,) of points (..., 3) from the axis through the origin."""
    return np.linalg.norm(np.cross(at, direction), axis=-1)


def said(rotation: FloatArray) -> str:
    """The rotation in words."""
    if np.array_equal(rotation, np.eye(3)):
        return "axes of the file kept"
    names = [_row(row) for row in rotation]
    return f"turned: our x, y, z are {', '.join(names)} of the file"


def _row(row: FloatArray) -> str:
    for k, axis in enumerate("xyz"):
        if abs(abs(row[k]) - 1.0) < _ROUND_OFF:
            return axis if row[k] > 0.0 else f"-{axis}"
    return f"({', '.join(f'{value:.4g}' for value in row)})"
