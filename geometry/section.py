"""The section of the airfoil in its own coordinates: along the camber line from its middle, and across."""

from dataclasses import dataclass, replace
from math import radians, sin

import numpy as np

from geometry.sector import FloatArray

GAUSS_POINT, GAUSS_WEIGHT = np.polynomial.legendre.leggauss(12)  # along the camber line
EDGE_FRACTION = 0.25  # thickness of a lens at its edges, relative to its largest


@dataclass(frozen=True)
class Section:
    """A section of the airfoil, symmetric about its camber line, a circular arc; its centroid is the origin.

    "rectangle": constant thickness. "lens": parabolic on both sides, from ``thickness`` in the middle to a quarter of
    it at the two edges (a sharp edge would leave no room for a hexahedron). The thickness is normal to the camber
    line, so the area is that of the straight section of the same length: length * thickness, and 3/4 of it.
    """

    shape: str  # shape of the section
    chord: float  # chord (between the ends of the camber line) and largest thickness, m
    thickness: float  # chord (between the ends of the camber line) and largest thickness, m
    camber: float = 0.0  # angle by which the camber line turns, degrees; above 0 it bulges towards the upper flank
    offset: float = 0.0  # how far a fillet moves the outline outward, m; corners stay corners

    @property
    def radius(self) -> float:
        """Radius of a camber line that is not straight, m; its centre lies below a positive camber."""
        return self.chord / (2 * sin(radians(self.camber) / 2))

    @property
    def half_camber_line(self) -> float:
        """Half the length of the camber line, m."""
        return self.radius * radians(self.camber) / 2 if self.camber else self.chord / 2

    @property
    def half_length(self) -> float:
        """Half the length along the camber line with the offset at the ends, m."""
        return self.half_camber_line + self.offset

    @property
    def straight(self) -> bool:
        """True where both flanks are straight lines."""
        return self.shape == "rectangle" and not self.camber

    @property
    def turned(self) -> "Section":
        """The section rotated by 180 degrees."""
        return replace(self, camber=0.0 - self.camber)

    def half_thickness(self, along: FloatArray) -> FloatArray:
        """Half thickness (m) at the distance ``along`` (m) along the camber line from its middle."""
        if self.shape == "rectangle":
            return np.full(np.shape(along), self.thickness / 2 + self.offset)
        half = self.half_camber_line
        if self.offset > 0:  # beyond the ends of the section itself
            along = np.clip(along, -half, half)
        bulge = 1 - (np.asarray(along) / half) ** 2
        return self.thickness / 2 * (EDGE_FRACTION + (1 - EDGE_FRACTION) * bulge) + self.offset

    def bent(self, strip: FloatArray) -> FloatArray:
        """Places (..., 2) along and across the chord of ``strip`` (..., 2), along and across the camber line."""
        if not self.camber:
            return strip
        turn, radius = strip[..., 0] / self.radius, self.radius + strip[..., 1]
        return np.stack([radius * np.sin(turn), radius * np.cos(turn) - self._centroid()], axis=-1)

    def straightened(self, points: FloatArray) -> FloatArray:
        """The inverse of ``bent``."""
        if not self.camber:
            return points
        side = np.sign(self.radius)
        x, y = side * points[..., 0], side * (points[..., 1] + self._centroid())
        return np.stack([self.radius * np.arctan2(x, y), side * np.hypot(x, y) - self.radius], axis=-1)

    def _centroid(self) -> float:
        """Distance (m) of the centroid from the centre of the camber line, without the offset."""
        along = self.half_camber_line * GAUSS_POINT
        thickness = 2 * replace(self, offset=0.0).half_thickness(along)
        moment = thickness * (self.radius + thickness**2 / (12 * self.radius)) * np.cos(along / self.radius)
        return float(GAUSS_WEIGHT @ moment / (GAUSS_WEIGHT @ thickness))
