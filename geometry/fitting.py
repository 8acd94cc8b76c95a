"""Whether the airfoil fits on its shroud, and the nearest parameters that do."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from geometry.cut import cut_beyond_airfoil
from geometry.outlines import cross, distance, inside
from geometry.planform import Planform, section_half_thickness
from geometry.sector import FloatArray

CLEARANCE = 0.02  # least distance between outlines and least side edge, relative to the smaller side of the platform
ANGLE_STEP = 0.1  # degrees: resolution of suggested angles
LENGTH_DIGITS = 5  # suggested lengths are rounded down to 0.01 mm
FLANK_POINTS = 33


def clearance(plan: Planform) -> float:
    """Least distance (m) required between the outlines of airfoil and platform."""
    return CLEARANCE * min(plan.width, plan.pitch)


def airfoil_outline(plan: Planform) -> FloatArray:
    """Corners (k, 2) of the section at the shroud in the plane (x, s), counterclockwise; a lens is sampled."""
    count = 2 if plan.section == "rectangle" else FLANK_POINTS
    along = np.linspace(plan.chord / 2, -plan.chord / 2, count)
    across = section_half_thickness(plan.section, plan.chord, plan.thickness, along)
    upper = np.stack([along, across], axis=-1)
    return plan.place(np.vstack([upper, -upper]))


def edges_fit(plan: Planform) -> bool:
    """True where a side edge is left on both sides of the contact segment: |contact_length cos alpha| < width."""
    return plan.width / 2 - plan.contact_half[0] >= clearance(plan)


def airfoil_fits(plan: Planform) -> bool:
    """True where the airfoil lies on the platform with clearance on all sides, at the notches too."""
    airfoil, platform = airfoil_outline(plan), plan.outline()
    if not bool(inside(airfoil, platform).all()) or cross(airfoil, platform):
        return False
    least = min(distance(airfoil, platform), distance(platform, airfoil))
    return least >= clearance(plan)


def fits(plan: Planform) -> bool:
    """True where both the profile and the airfoil fit, with room for the cut of the planform."""
    return edges_fit(plan) and airfoil_fits(plan) and cut_beyond_airfoil(plan) is not None


def largest(plan_of: Callable[[float], Planform], start: float) -> float | None:
    """The largest length up to ``start`` (m) for which ``plan_of`` gives a planform that fits, rounded down.

    None where not even a thousandth of ``start`` does.
    """
    low, high = start / 1000, start
    if not fits(plan_of(low)):
        return None
    for _ in range(30):
        middle = (low + high) / 2
        low, high = (middle, high) if fits(plan_of(middle)) else (low, middle)
    rounded = float(np.floor(low * 10**LENGTH_DIGITS) / 10**LENGTH_DIGITS)
    return rounded if rounded > 0 and fits(plan_of(rounded)) else low


def nearest_angle(plan_at: Callable[[float], Planform], angle: float) -> float | None:
    """The multiple of 0.1 degrees in (0, 180] nearest to ``angle`` whose planform fits; None where none does."""
    candidates = np.arange(1, round(180 / ANGLE_STEP) + 1) * ANGLE_STEP
    for candidate in candidates[np.argsort(np.abs(candidates - angle), kind="stable")]:
        rounded = round(float(candidate), 1)
        if fits(plan_at(rounded)):
            return rounded
    return None


def without_notch(plan: Planform) -> Planform:
    """The same platform with straight sides."""
    return replace(plan, angle=0.0, contact_length=plan.width / 1000)
