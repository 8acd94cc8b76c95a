"""What a user chooses: the blade, its shroud and how finely they are meshed (metres, degrees)."""

from dataclasses import dataclass


@dataclass(frozen=True)
class BladeParameters:
    """One of ``n_blades`` equal blades, clamped at ``hub_radius``.

    The outer surface of the shroud lies at ``hub_radius + length``. The section is axial (chord along x) at the
    root and turned by ``twist`` degrees about +z (x towards y) at the shroud's inner surface, linearly in the radius
    between them. The thickness goes linearly from ``thickness`` at the root to ``tip_thickness`` (None: the same) at
    the shroud. Chord and thickness are measured on the cylinder of each radius, so a section is true to size
    everywhere. ``section`` is "rectangle" or "lens" (see ``section_half_thickness``).
    """

    n_blades: int
    hub_radius: float
    length: float
    chord: float
    thickness: float
    tip_thickness: float | None = None
    twist: float = 0.0
    section: str = "rectangle"


@dataclass(frozen=True)
class ShroudParameters:
    """The platform at the tip: one pitch wide less ``gap``, its two sides Z-profiles (side edge, contact, side edge).

    ``angle`` is the shroud angle alpha in degrees, 0 < alpha <= 180, between the engine axis and the tangent line of
    the contact face. ``contact_length`` is measured along that line, ``axial_width`` along x, ``thickness`` along the
    radius, and ``gap`` (the design gap between neighbours) along the circumference; lengths along the circumference
    are those at the mid radius of the shroud.
    """

    angle: float
    thickness: float
    axial_width: float
    contact_length: float
    gap: float = 0.0


@dataclass(frozen=True)
class MeshParameters:
    """How finely the blade is meshed.

    ``size``: edge of the elements that is aimed at, m. ``contact_grid``: contact nodes on each contact face (along
    t1, along t2). ``grading``: how many times thinner than at mid span the airfoil's layers of elements are at the
    root and at the shroud, where the re-entrant corners are; 1: all alike.
    """

    size: float
    contact_grid: tuple[int, int] = (3, 3)
    grading: float = 4.0
