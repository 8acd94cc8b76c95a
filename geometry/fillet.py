"""Fillets between the airfoil and the hub or the shroud: how far the outline of the section moves outward.

The fillet is a quarter of a circle of radius r, tangent to the wall and to the airfoil: at the distance d from the
wall the outline stands out by r - sqrt(r^2 - (r - d)^2).
"""

from math import ceil, pi, sqrt

import numpy as np

from geometry.sector import FloatArray

LEAST_LAYERS = 3
GAUSS_POINTS = 12


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
    point, weight = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    half = np.diff(angles)[:, None] / 2
    t = (angles[:-1, None] + half * (1 + point)).ravel()
    weights = (half * weight).ravel() * np.sin(t)
    hats = np.stack([np.interp(1.0 - np.cos(t), knots, unit) for unit in np.eye(count + 1)[:-1]], axis=-1)
    mass = hats.T @ (weights[:, None] * hats)
    area = weights @ hats
    system = np.block([[mass, area[:, None]], [area[None, :], np.zeros((1, 1))]])
    load = np.append(hats.T @ (weights * (1.0 - np.sin(t))), 1.0 - pi / 4)
    return np.append(radius * np.linalg.solve(system, load)[:-1], 0.0)
