"""The shroud seen from the tip: the outline of the platform and of the airfoil, in the developed plane (x, s).

s is the arc length along the circumference at the mid radius of the shroud. Angles are at most 90 degrees here: the
profile at alpha > 90 is the mirror image (x -> -x) of the one at 180 - alpha with the opposite stagger and slant of
the side edges. The platform is symmetric under (x, s) -> (-x, -s), the airfoil too without camber, and the left side
is the right one moved by one pitch, whatever the slant.
"""

from dataclasses import dataclass, replace
from math import cos, pi, radians, sin, tan

import numpy as np

from geometry.blade.parameters import BladeParameters, ShroudParameters
from geometry.blade.section import Section
from geometry.sector import FloatArray

LEAST_CAMBER = 1e-3  # degrees: less bulges by less than 3e-6 chords, and is no camber


@dataclass(frozen=True)
class Planform:
    """Platform and section of the airfoil in the plane (x, s), lengths in m."""

    angle: float  # shroud angle, degrees, 0 <= angle <= 90
    # `width`, `pitch`: extent of the platform along x and along s
    width: float
    pitch: float
    contact_length: float  # length of the contact segments
    edge_angle: float  # angle from x to the side edges, degrees
    section: Section  # section of the airfoil at the shroud
    stagger: float  # angle from x to the chord at the shroud, degrees
    # mid radius of the shroud over its inner radius, where the airfoil ends: the scale of arcs in the plane
    stretch: float

    @property
    def contact_half(self) -> tuple[float, float]:
        """Half extent of the contact segment along x and along s, m."""
        half = self.contact_length / 2
        # cos(90 degrees) is not 0 in floating point; the axial face must be exactly axial
        along_x = 0.0 if self.angle == 90.0 else half * cos(radians(self.angle))
        return along_x, half * sin(radians(self.angle))

    @property
    def end_offset(self) -> float:
        """How far the middle of the platform lies from s = 0 at its axial edge at +x, m."""
        dx, ds = self.contact_half
        return ds + (self.width / 2 - dx) * tan(radians(self.edge_angle))

    @property
    def breadth(self) -> float:
        """Distance between the side edges of the two sides, m."""
        return self.pitch * cos(radians(self.edge_angle))

    def right_profile(self) -> FloatArray:
        """Corners of the +y side along +x, (4, 2): side edge, contact segment, side edge."""
        dx, ds = self.contact_half
        middle, end = self.pitch / 2, self.end_offset
        return np.array(
            [
                [-self.width / 2, middle - end],
                [-dx, middle - ds],
                [dx, middle + ds],
                [self.width / 2, middle + end],
            ]
        )

    def outline(self) -> FloatArray:
        """Corners of the platform, (8, 2), counterclockwise."""
        right = self.right_profile()
        return np.vstack([-right[::-1], right[::-1]])

    def place(self, section: FloatArray) -> FloatArray:
        """(x, s) of section coordinates (along the camber line, across), (..., 2) in m."""
        section = self.section.bent(section)
        c, s = cos(radians(self.stagger)), sin(radians(self.stagger))
        x = section[..., 0] * c - section[..., 1] * s
        arc = section[..., 0] * s + section[..., 1] * c
        return np.stack([x, arc * self.stretch], axis=-1)

    def unplace(self, points: FloatArray) -> FloatArray:
        """Section coordinates of (x, s), the inverse of ``place``."""
        c, s = cos(radians(self.stagger)), sin(radians(self.stagger))
        x, arc = points[..., 0], points[..., 1] / self.stretch
        return self.section.straightened(np.stack([x * c + arc * s, arc * c - x * s], axis=-1))

    @property
    def turned(self) -> "Planform":
        """The planform rotated by 180 degrees: the same platform with the opposite camber."""
        return replace(self, section=self.section.turned) if self.section.camber else self


def mid_radius(blade: BladeParameters, shroud: ShroudParameters) -> float:
    """Mid radius of the shroud, m, at which lengths along the circumference are measured."""
    return blade.hub_radius + blade.length - shroud.thickness / 2


def inner_radius(blade: BladeParameters, shroud: ShroudParameters) -> float:
    """Radius of the shroud's inner surface, m, where the airfoil ends."""
    return blade.hub_radius + blade.length - shroud.thickness


def is_mirrored(shroud: ShroudParameters) -> bool:
    """True where the sector is the mirror image of the one at 180 - alpha."""
    return shroud.angle > 90.0


def upright(blade: BladeParameters, shroud: ShroudParameters) -> BladeParameters:
    """The blade before its sector is mirrored, where it is."""
    if not is_mirrored(shroud):
        return blade
    sections = None if blade.sections is None else blade.sections.mirrored
    return replace(blade, root_stagger=-blade.root_stagger, twist=-blade.twist, sections=sections)


def section_at(blade: BladeParameters, height: float) -> Section:
    """The section at the relative ``height`` (0 root, 1 shroud), without fillets."""
    tip = blade.thickness if blade.tip_thickness is None else blade.tip_thickness
    camber = blade.camber if abs(blade.camber) >= LEAST_CAMBER else 0.0
    return Section(blade.section, blade.chord, (1 - height) * blade.thickness + height * tip, camber)


def planform(blade: BladeParameters, shroud: ShroudParameters, edge_angle: float) -> Planform:
    """The planform of a blade with side edges at ``edge_angle``, degrees; for alpha > 90 that of its mirror image."""
    mirrored = is_mirrored(shroud)
    radius = mid_radius(blade, shroud)
    return Planform(
        angle=180.0 - shroud.angle if mirrored else shroud.angle,
        width=shroud.axial_width,
        pitch=2 * pi * radius / blade.n_blades - shroud.gap,
        contact_length=shroud.contact_length,
        edge_angle=-edge_angle if mirrored else edge_angle,
        section=replace(section_at(blade, 1.0), offset=shroud.fillet_radius),
        stagger=-blade.tip_stagger if mirrored else blade.tip_stagger,
        stretch=radius / inner_radius(blade, shroud),
    )
