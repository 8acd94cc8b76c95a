"""Whether the airfoils of neighbouring blades touch."""

from dataclasses import replace
from math import cos, pi, radians, sin

import numpy as np

from geometry.fillet import fillet_offset
from geometry.parameters import BladeParameters, ShroudParameters
from geometry.planform import inner_radius, section_at

HEIGHTS = np.linspace(0.0, 1.0, 9)  # at which the sections are compared


def airfoils_touch(blade: BladeParameters, shroud: ShroudParameters) -> bool:
    """True where the sections of two neighbours meet at some height.

    A convex section that is symmetric about its centre meets its copy moved by a vector where it contains half of
    that vector.
    """
    span = inner_radius(blade, shroud) - blade.hub_radius
    for height in map(float, HEIGHTS):
        half_pitch = pi * (blade.hub_radius + height * span) / blade.n_blades
        stagger = radians(blade.root_stagger + height * blade.twist)
        offset = fillet_offset(height * span, blade.fillet_radius)
        section = replace(section_at(blade, height), offset=offset)
        along, across = half_pitch * abs(sin(stagger)), half_pitch * cos(stagger)
        if along <= section.half_length and across <= section.half_thickness(np.array(along)):
            return True
    return False
