"""Nodes of a curved flank whose element edges are straight.

With nodes on the curve itself the chords between them would make the section too thin and too flexible, by the second
order of the element size. The piecewise linear thickness nearest to the curve, by least squares along the chord, has
the same area and bending stiffness up to the fourth order.
"""

import numpy as np

from geometry.section import Section
from geometry.sector import FloatArray

GAUSS_POINTS = 3  # on each piece: exact for the parabolas of a lens times the piecewise linear functions


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
