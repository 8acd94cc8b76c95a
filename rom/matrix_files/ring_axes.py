"""Units and axes of a model from elsewhere: metres, x along the engine axis, z through the contact faces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geometry import NAMED_AXES, UNIT_SYSTEMS, axes_through
from rom.errors import RomParameterError

_ON_AXIS = 1e-9  # of the largest distance from the axis


@dataclass(frozen=True)
class RingAxes:
    """Rows: x, y, z of the ring in the axes of the file; a point on the engine axis; the unit of length."""

    rows: NDArray[np.float64]  # (3, 3), directions, orthonormal and right-handed; x is the engine axis, z outward
    origin: NDArray[np.float64]  # (3,), point on the axis, in the unit of the file
    unit: str  # A name in `UNIT_SYSTEMS`: "mm" goes with N, t, "in" with lbf, lbf s^2/in

    @property
    def turned(self) -> bool:
        """Whether they are others than the axes of the file."""
        return not np.array_equal(self.rows, np.eye(3))

    def points(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points (n, 3) of the file in metres and the axes of the ring."""
        moved = points - self.origin if np.any(self.origin) else points
        moved = moved @ self.rows.T if self.turned else moved
        return moved * UNIT_SYSTEMS[self.unit].length

    def directions(self, vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        """Directions (..., 3) of the file in the axes of the ring."""
        return vectors @ self.rows.T if self.turned else vectors


def ring_axes(axis: str | ArrayLike, point: ArrayLike, unit: str, at: NDArray[np.float64]) -> RingAxes:
    """Axes of the ring: x along `axis` through `point`, z through the point `at` (3,), all in the axes of the file.

    Raises RomParameterError for an unknown axis or unit and a point on the axis.
    """
    if unit not in UNIT_SYSTEMS:
        raise RomParameterError("model", "unit", unit, f"must be one of {', '.join(UNIT_SYSTEMS)}")
    if isinstance(axis, str) and axis not in NAMED_AXES:
        raise RomParameterError("model", "axis", axis, f"must be one of {', '.join(NAMED_AXES)} or three numbers")
    x = np.asarray(NAMED_AXES[axis] if isinstance(axis, str) else axis, dtype=float)
    length = np.linalg.norm(x)
    if x.shape != (3,) or not np.isfinite(length) or length == 0.0:
        raise RomParameterError("model", "axis", axis, "must be three finite numbers, not all 0")
    x = x / length
    origin = np.asarray(point, dtype=float)
    arm = at - origin
    radius = np.linalg.norm(arm - (arm @ x) * x)
    if radius <= _ON_AXIS * np.linalg.norm(arm) or radius == 0.0:
        raise RomParameterError("model", "axis", axis, "must be an axis that the contact faces stand around")
    return RingAxes(axes_through(x, arm), origin, unit)
