"""Slant of the side edges of the platform: as given, or the one that leaves most room for the airfoil."""

from dataclasses import replace
from math import copysign

import numpy as np

from geometry.fitting import FLANK_POINTS, airfoil_outline, corners_fit, edges_fit, fits
from geometry.parameters import BladeParameters, ShroudParameters
from geometry.planform import Planform, is_mirrored, planform
from geometry.sector import FloatArray

AUTO = "auto"
LARGEST_SLANT = 75.0  # degrees
RATIO_DIGITS = 6  # rooms that are equal in these leave the choice to the smaller slant
SLANTS = np.arange(1.0, LARGEST_SLANT + 1.0)
MOST_TRIED = 12
WIDE = 4.0  # factor of the axial width with which the sides go on beyond the airfoil


def fitted_planform(blade: BladeParameters, shroud: ShroudParameters) -> Planform:
    """The planform of a blade with its side edges as given; with "auto" axial where that fits, else slanted.

    The slant is that with the most room between airfoil and platform: towards the stagger at the shroud if one of
    these fits, else any; where none fits, the one that lacks least.
    """
    if shroud.edge_angle != AUTO:
        return planform(blade, shroud, float(shroud.edge_angle))
    axial = planform(blade, shroud, 0.0)
    if fits(axial):
        return axial
    airfoil = airfoil_outline(axial, FLANK_POINTS)
    too_narrow = np.abs(airfoil[:, 0]).max() > axial.width / 2  # whatever the slant
    tried = [(_room(axial, airfoil), axial)]
    towards = copysign(1.0, blade.tip_stagger or (-1.0 if is_mirrored(shroud) else 1.0))
    for slants in (towards * SLANTS, -towards * SLANTS):
        plans = [planform(blade, shroud, float(slant)) for slant in slants]
        slanted = [(_room(plan, airfoil), plan) for plan in plans]
        slanted.sort(key=lambda pair: pair[0], reverse=True)
        possible = [] if too_narrow else [plan for room, plan in slanted[:MOST_TRIED] if room > 0]
        fitting = next((plan for plan in possible if fits(plan)), None)
        if fitting is not None:
            return fitting
        tried += sorted(slanted, key=lambda pair: abs(pair[1].edge_angle))
    return max(tried, key=lambda pair: round(pair[0] / pair[1].breadth, RATIO_DIGITS))[1]


def _room(plan: Planform, airfoil: FloatArray) -> float:
    """Room between the outline of the airfoil and the two sides, m; minus the width for an impossible profile.

    It is measured along s and projected on the normal of the side edges; the axial edges are no matter of the slant.
    """
    if not (corners_fit(plan) and edges_fit(plan)):
        return -plan.width
    right = replace(plan, width=WIDE * plan.width).right_profile()
    above = np.interp(airfoil[:, 0], *right.T) - airfoil[:, 1]
    below = (
        np.interp(-airfoil[:, 0], *right.T) + airfoil[:, 1]
    )  # the left side is the right one rotated by 180 degrees
    return float(min(above.min(), below.min())) * plan.breadth / plan.pitch


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
    """
    slant = fitted_planform(blade, shroud).edge_angle
    return 0.0 - slant if is_mirrored(shroud) else slant
