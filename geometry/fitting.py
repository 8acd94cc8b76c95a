"""Whether the airfoil fits on its shroud, with how much room, and why not."""

from dataclasses import replace

import numpy as np

from geometry.cut import cut_beyond_airfoil
from geometry.outlines import cross, distances, inside
from geometry.planform import Planform
from geometry.sector import FloatArray

CLEARANCE = 0.02  # least distance between outlines and least side edge, relative to the smaller side of the platform
LEAST_CORNER = 25.0  # degrees between a side edge and the contact segment
FLANK_POINTS = 33


def clearance(plan: Planform) -> float:
    """Least distance (m) required between the outlines of airfoil and platform."""
    return CLEARANCE * min(plan.width, plan.breadth)


def airfoil_outline(plan: Planform, flank_points: int = 0) -> FloatArray:
    """Corners (k, 2) of the section at the shroud in the plane (x, s), counterclockwise; curved flanks sampled."""
    half = plan.section.half_length
    along = np.linspace(half, -half, flank_points or (2 if plan.section.straight else FLANK_POINTS))
    across = plan.section.half_thickness(along)
    upper = np.stack([along, across], axis=-1)
    return plan.place(np.vstack([upper, -upper]))


def edges_fit(plan: Planform) -> bool:
    """True where a side edge is left on both sides of the contact segment: |contact_length cos alpha| < width."""
    return plan.width / 2 - plan.contact_half[0] >= clearance(plan)


def corners_fit(plan: Planform) -> bool:
    """True where the side edges do not fold back along the contact segment."""
    return plan.angle - plan.edge_angle <= 180.0 - LEAST_CORNER


def airfoil_room(plan: Planform) -> float:
    """Least distance (m) from the airfoil to the sides of the platform; negative: how far it stands out."""
    airfoil, platform = airfoil_outline(plan), plan.outline()
    on_platform = np.where(inside(airfoil, platform), 1.0, -1.0)
    off_airfoil = np.where(inside(platform, airfoil), -1.0, 1.0)
    room = min(
        float((on_platform * distances(airfoil, platform)).min()),
        float((off_airfoil * distances(platform, airfoil)).min()),
    )
    return min(room, 0.0) if cross(airfoil, platform) else room


def airfoil_fits(plan: Planform) -> bool:
    """True where the airfoil lies on the platform with clearance on all sides, at the notches too."""
    return airfoil_room(plan) >= clearance(plan)


def misfit(plan: Planform) -> str | None:
    """Why the airfoil and the profile do not fit together; None where they do."""
    if not corners_fit(plan):
        return f"the side edges would fold back along the contact, under less than {LEAST_CORNER:g} degrees"
    if not edges_fit(plan):
        return "contact_length |cos(angle)| leaves no side edge within axial_width"
    if not airfoil_fits(plan):
        return "the notch of the profile would cut the airfoil"
    if cut_beyond_airfoil(plan) is None or cut_beyond_airfoil(plan.turned) is None:
        return "the airfoil, turned by its stagger, leaves no way along the middle of the platform"
    return None


def fits(plan: Planform) -> bool:
    """True where both the profile and the airfoil fit, with room for the cut of the planform."""
    return misfit(plan) is None


def without_notch(plan: Planform) -> Planform:
    """The same platform with straight sides."""
    slant = plan.edge_angle
    return replace(plan, angle=max(slant, 0.0), contact_length=plan.width / 1000)
