"""Slant of the side edges of the platform: as given, or the one that leaves most room for the airfoil."""

from dataclasses import replace
from math import copysign

import numpy as np

from geometry.fitting import FLANK_POINTS, airfoil_outline, corners_fit, edges_fit, fits
from geometry.parameters import BladeParameters, ShroudParameters
from geometry.planform import Planform, is_mirrored, planform

AUTO = "auto"
LARGEST_SLANT = 75.0  # degrees
SLANTS = np.arange(1.0, LARGEST_SLANT + 1.0)
MOST_TRIED = 12
WIDE = 4.0  # factor of the axial width with which the sides go on beyond the airfoil


def fitted_planform(blade: BladeParameters, shroud: ShroudParameters) -> Planform:
    """The planform of a blade with its side edges as given; with "auto" axial where that fits, else slanted.

    The slant is that with the most room between airfoil and platform: towards the stagger at the shroud if one of
    these fits, else any; axial where none fits.
    """
    if shroud.edge_angle != AUTO:
        return planform(blade, shroud, float(shroud.edge_angle))
    axial = planform(blade, shroud, 0.0)
    if fits(axial):
        return axial
    towards = copysign(1.0, blade.tip_stagger or (-1.0 if is_mirrored(shroud) else 1.0))
    for slants in (towards * SLANTS, -towards * SLANTS):
        plans = [planform(blade, shroud, float(slant)) for slant in slants]
        rooms = [_room(plan) for plan in plans]
        roomiest = sorted(range(len(plans)), key=rooms.__getitem__, reverse=True)[:MOST_TRIED]
        slanted = next((plans[k] for k in roomiest if rooms[k] > 0 and fits(plans[k])), None)
        if slanted is not None:
            return slanted
    return axial


def _room(plan: Planform) -> float:
    """Room between the airfoil and the two sides, m; minus the width where the profile itself is impossible.

    It is measured along s and projected on the normal of the side edges; the axial edges are no matter of the slant.
    """
    if not (corners_fit(plan) and edges_fit(plan)):
        return -plan.width
    airfoil = airfoil_outline(plan, FLANK_POINTS)
    right = replace(plan, width=WIDE * plan.width).right_profile()
    above = np.interp(airfoil[:, 0], *right.T) - airfoil[:, 1]
    return float(above.min()) * plan.breadth / plan.pitch  # and by symmetry below


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
