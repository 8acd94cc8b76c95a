"""Slant of the side edges of the platform: as given, or the one that leaves most room for the airfoil."""

from dataclasses import replace
from math import copysign

import numpy as np

from geometry.fitting import (
    FLANK_POINTS,
    airfoil_fits,
    airfoil_outline,
    corners_fit,
    edges_fit,
    fits,
    without_notch,
)
from geometry.parameters import BladeParameters, ShroudParameters
from geometry.planform import Planform, is_mirrored, planform
from geometry.sector import FloatArray

AUTO = "auto"
LARGEST_SLANT = 75.0  # degrees
ROOM_DIGITS = 6  # rooms that are equal in these leave the choice to the smaller slant
SLANTS = np.arange(1.0, LARGEST_SLANT + 1.0)
MOST_TRIED = 8


def fitted_planform(blade: BladeParameters, shroud: ShroudParameters) -> Planform:
    """The planform of a blade with its side edges as given; with "auto" axial where that fits, else slanted.

    The slant is that with the most room between airfoil and platform: towards the stagger at the shroud if one of
    these fits, else any. Where none fits, the edges are axial if the notch alone is in the way, else those that lack
    least.
    """
    if shroud.edge_angle != AUTO:
        return planform(blade, shroud, float(shroud.edge_angle))
    axial = planform(blade, shroud, 0.0)
    if fits(axial):
        return axial
    airfoil = airfoil_outline(axial, FLANK_POINTS)
    towards = copysign(1.0, axial.stagger or 1.0)
    for slants in (towards * SLANTS, -towards * SLANTS) if np.abs(airfoil[:, 0]).max() < axial.width / 2 else ():
        rooms = _rooms(axial, slants, airfoil)
        best = [k for k in np.argsort(-rooms, kind="stable")[:MOST_TRIED] if rooms[k] > 0]
        plans = (replace(axial, edge_angle=float(slants[k])) for k in best)
        fitting = next((plan for plan in plans if fits(plan)), None)
        if fitting is not None:
            return fitting
    if airfoil_fits(without_notch(axial)):
        return axial
    slants = np.concatenate([[0.0], towards * SLANTS, -towards * SLANTS])
    relative = _rooms(axial, slants, airfoil) / np.cos(np.radians(slants))
    least = np.lexsort([np.abs(slants), -relative.round(ROOM_DIGITS)])[0]
    return replace(axial, edge_angle=float(slants[least]))


def _rooms(axial: Planform, slants: FloatArray, airfoil: FloatArray) -> FloatArray:
    """Room (k,) between the outline of the airfoil and the two sides at the ``slants`` (k,), in pitches.

    It is measured along s and projected on the normal of the side edges; the axial edges are no matter of the slant.
    It is -1 where the profile itself is impossible.
    """
    dx, ds = axial.contact_half
    outline = np.vstack([airfoil, -airfoil])  # the left side is the right one rotated by 180 degrees
    x, s = outline.T
    beyond = np.sign(x) * np.maximum(np.abs(x) - dx, 0.0)
    contact = np.interp(x, [-dx, dx], [-ds, ds]) if dx > 0 else np.sign(x) * ds
    above = axial.pitch / 2 + contact - s + beyond * np.tan(np.radians(slants))[:, None]
    rooms = above.min(axis=1) / axial.pitch * np.cos(np.radians(slants))
    possible = [edges_fit(axial) and corners_fit(replace(axial, edge_angle=float(slant))) for slant in slants]
    return np.where(possible, rooms, -1.0)


def side_edge_angle(blade: BladeParameters, shroud: ShroudParameters) -> float:
    """Angle between the engine axis and the side edges of the platform.

    Parameters
    ----------
    blade : BladeParameters
        The airfoil.
    shroud : ShroudParameters
        The shroud; its own value, or with "auto" the chosen one.

    Returns
    -------
    float
        Degrees, positive from x towards y as the stagger.

    Examples
    --------
    A radial blade without stagger fits between axial side edges:

    >>> from geometry import BladeParameters, ShroudParameters, side_edge_angle
    >>> blade = BladeParameters(n_blades=40, hub_radius=0.3, length=0.1, chord=0.02, thickness=0.008)
    >>> shroud = ShroudParameters(angle=45.0, thickness=0.01, axial_width=0.04, contact_length=0.01)
    >>> side_edge_angle(blade, shroud)
    0.0
    """
    slant = fitted_planform(blade, shroud).edge_angle
    return 0.0 - slant if is_mirrored(shroud) else slant
