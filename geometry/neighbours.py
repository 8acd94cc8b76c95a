"""Whether the airfoils of neighbouring blades touch."""

from dataclasses import replace
from math import cos, pi, radians, sin

import numpy as np

from geometry.fillet import fillet_offset
from geometry.outlines import cross, inside
from geometry.parameters import BladeParameters, ShroudParameters
from geometry.planform import inner_radius, section_at
from geometry.section import Section
from geometry.sector import FloatArray

OUTLINE_POINTS = 25
HEIGHTS = np.linspace(0.0, 1.0, 9)  # at which the sections are compared


def airfoils_touch(blade: BladeParameters, shroud: ShroudParameters) -> bool:
    """True where the sections of two neighbours meet at some height."""
    span = inner_radius(blade, shroud) - blade.hub_radius
    for height in map(float, HEIGHTS):
        pitch = 2 * pi * (blade.hub_radius + height * span) / blade.n_blades
        stagger = radians(blade.root_stagger + height * blade.twist)
        offset = fillet_offset(height * span, blade.fillet_radius)
        section = replace(section_at(blade, height), offset=offset)
        if _meets_its_copy(section, np.array([pitch * sin(stagger), pitch * cos(stagger)])):
            return True
    return False


def _meets_its_copy(section: Section, moved: FloatArray) -> bool:
    """Whether a section meets its copy at the distance ``moved`` (2,) m, in its own directions.

    A convex section that is symmetric about its centre does where it contains half of that vector.
    """
    if not section.camber:
        along, across = np.abs(moved) / 2
        return bool(along <= section.half_length and across <= section.half_thickness(along))
    along = np.linspace(section.half_length, -section.half_length, OUTLINE_POINTS)
    upper = np.stack([along, section.half_thickness(along)], axis=-1)
    outline = section.bent(np.vstack([upper, -upper]))
    if (np.abs(moved) > np.ptp(outline, axis=0)).any():
        return False
    copy = outline + moved
    return cross(outline, copy) or bool(inside(outline, copy).any() or inside(copy, outline).any())
