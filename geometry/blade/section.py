"""The section of the airfoil in its own coordinates, along the camber line from its middle and across, and its nodes.

The edges of elements are straight. With nodes on a curved flank itself the chords between them would make the section
too thin and too flexible, by the second order of the element size. The piecewise linear thickness nearest to the
curve, by least squares along the chord, has the same area and bending stiffness up to the fourth order.

A fillet between the airfoil and the hub or the shroud is a quarter of a circle of radius r, tangent to the wall and
to the airfoil: at the distance d from the wall the outline of the section stands out by r - sqrt(r^2 - (r - d)^2).
"""

from dataclasses import dataclass, replace
from math import ceil, pi, radians, sin, sqrt

import numpy as np

from geometry.sector import FloatArray

GAUSS_POINT, GAUSS_WEIGHT = np.polynomial.legendre.leggauss(12)  # along the camber line
EDGE_FRACTION = 0.25  # thickness of a lens at its edges, relative to its largest
GAUSS_POINTS = 3  # on each piece: exact for the parabolas of a lens times the piecewise linear functions
LEAST_LAYERS = 3
FILLET_GAUSS_POINTS = 12


@dataclass(frozen=True)
class Section:
    """A section of the airfoil, symmetric about its camber line, a circular arc; its centroid is the origin.

    "rectangle": constant thickness. "lens": parabolic on both sides, from ``thickness`` in the middle to a quarter of
    it at the two edges (a sharp edge would leave no room for a hexahedron). The thickness is normal to the camber
    line, so the area is that of the straight section of the same length: length * thickness, and 3/4 of it.
    """

    shape: str  # shape of the section
    # `chord`, `thickness`: chord (between the ends of the camber line) and largest thickness, m
    chord: float
    thickness: float
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


def straight_edged_half_thickness(section: Section, along: FloatArray) -> FloatArray:
    """Half thickness (k,) m of the section at its nodes, ``along`` (k,) m from the middle, ascending."""
    if section.shape == "rectangle":
        return section.half_thickness(along) * _mitre(section, along)
    point, weight = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    half = np.diff(along)[:, None] / 2
    places = (along[:-1, None] + half * (1 + point)).ravel()
    root = np.sqrt(half * weight).ravel()
    curve = section.half_thickness(places)
    hats = np.stack([np.interp(places, along, unit) for unit in np.eye(len(along))], axis=-1)
    return np.asarray(np.linalg.lstsq(root[:, None] * hats, root * curve)[0]) * _mitre(section, along)


def _mitre(section: Section, along: FloatArray) -> FloatArray | float:
    """Factor of the distance from a camber line of straight pieces that keeps the thickness normal to the pieces."""
    if not section.camber:
        return 1.0
    turn = np.diff(along) / section.radius
    at_node = np.concatenate([turn[:1], (turn[1:] + turn[:-1]) / 2, turn[-1:]])
    return np.asarray(1 / np.cos(at_node / 2))


def resized(points: FloatArray, flanks: tuple[FloatArray, FloatArray], old: Section, new: Section) -> FloatArray:
    """Points (k, 2) of the section ``new`` at the places of ``points`` of the section ``old``, flank on flank.

    ``flanks`` are the nodes on the upper and on the lower flank of ``old``, along it, ascending.
    """
    stretch = new.half_length / old.half_length
    along = points[:, 0] * stretch
    if old.offset == new.offset == 0.0:
        return np.stack([along, points[:, 1] * (new.thickness / old.thickness)], axis=-1)
    upper, lower = (
        np.interp(along, nodes * stretch, straight_edged_half_thickness(new, nodes * stretch))
        / np.interp(points[:, 0], nodes, straight_edged_half_thickness(old, nodes))
        for nodes in flanks
    )
    return np.stack([along, points[:, 1] * np.where(points[:, 1] > 0, upper, lower)], axis=-1)


def fillet_offset(distance: float, radius: float) -> float:
    """Offset (m) of the outline at ``distance`` (m) from the wall."""
    if distance >= radius:
        return 0.0
    return radius - sqrt(radius**2 - (radius - distance) ** 2)


def fillet_layers(radius: float, size: float) -> FloatArray:
    """Offsets (n + 1,) m of the nodes of the fillet's n equal layers, from the wall on; one zero for radius 0.

    The edges of elements are straight, and with nodes on the circle the chords between them would hold too much
    material. The offsets are those of the piecewise linear function nearest to the circle, by least squares, with the
    area of the fillet, (1 - pi/4) radius^2 for each length of wall.
    """
    if radius == 0.0:
        return np.zeros(1)
    count = max(LEAST_LAYERS, ceil(radius / size - 1e-6))
    knots = np.linspace(0.0, 1.0, count + 1)
    # d = r (1 - cos t) has no singularity at the wall
    angles = np.arccos(1.0 - knots)
    point, weight = np.polynomial.legendre.leggauss(FILLET_GAUSS_POINTS)
    half = np.diff(angles)[:, None] / 2
    t = (angles[:-1, None] + half * (1 + point)).ravel()
    weights = (half * weight).ravel() * np.sin(t)
    hats = np.stack([np.interp(1.0 - np.cos(t), knots, unit) for unit in np.eye(count + 1)[:-1]], axis=-1)
    mass = hats.T @ (weights[:, None] * hats)
    area = weights @ hats
    system = np.block([[mass, area[:, None]], [area[None, :], np.zeros((1, 1))]])
    load = np.append(hats.T @ (weights * (1.0 - np.sin(t))), 1.0 - pi / 4)
    return np.append(radius * np.linalg.solve(system, load)[:-1], 0.0)
