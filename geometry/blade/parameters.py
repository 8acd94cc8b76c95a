"""Parameters of the blade, its shroud and their mesh; metres and degrees."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

if TYPE_CHECKING:
    from geometry.blade.profiles import ProfileStack

LARGEST_STAGGER = 80.0  # degrees, at root and shroud
LARGEST_CAMBER = 90.0  # degrees


@dataclass(frozen=True)
class BladeParameters:
    """The airfoil of one of identical blades.

    Chord and thickness are measured on the cylinder of each radius, so that a section has its true size everywhere.

    Attributes
    ----------
    n_blades : int
        Number of blades of the ring.
    hub_radius : float
        Radius of the clamped root, m.
    length : float
        Radial distance from the root to the outer surface of the shroud, m.
    chord : float
        Chord of the section, m.
    thickness : float
        Largest thickness of the section at the root, m.
    tip_thickness : float or None
        Thickness at the shroud, m; None: as at the root. It varies linearly with the radius.
    twist : float
        Rotation of the section about +z (x towards y) from the root to the inner surface of the shroud, degrees;
        linear in the radius.
    section : {"rectangle", "lens"}
        Shape of the section. A lens has parabolic sides, with a quarter of the thickness at its edges.
    root_stagger : float
        Stagger at the root: angle from x to the chord about +z (x towards y), degrees. The stagger at the shroud is
        `root_stagger` + `twist`.
    fillet_radius : float
        Radius of the fillet at the root, m; 0: none.
    camber : float
        Angle by which the camber line, a circular arc, turns between its ends, degrees; above 0 it bulges towards
        +y. The centroids of the sections lie on the stacking axis, the thickness is normal to the camber line.
    sections : ProfileStack or None
        Sections as points, which take the place of the others from the chord on; these then are those of the
        parametric blade that is nearest to it.

    Examples
    --------
    >>> from geometry import BladeParameters
    >>> blade = BladeParameters(
    ...     n_blades=40, hub_radius=0.3, length=0.1, chord=0.03, thickness=0.004, root_stagger=30.0, twist=20.0
    ... )
    >>> blade.tip_stagger
    50.0
    """

    n_blades: int
    hub_radius: float
    length: float
    chord: float
    thickness: float
    tip_thickness: float | None = None
    twist: float = 0.0
    section: str = "rectangle"
    root_stagger: float = 0.0
    fillet_radius: float = 0.0
    camber: float = 0.0
    sections: ProfileStack | None = None

    @property
    def tip_stagger(self) -> float:
        """Stagger at the inner surface of the shroud, degrees."""
        return self.root_stagger + self.twist


@dataclass(frozen=True)
class ShroudParameters:
    """The platform at the tip of the blade. Each side is a Z-profile: side edge, contact segment, side edge.

    Lengths along the circumference are those at the mid radius of the shroud.

    Attributes
    ----------
    angle : float
        Shroud angle alpha, degrees, 0 < alpha <= 180: between the engine axis and the tangent line of the contact
        face, seen from the tip.
    thickness : float
        Radial thickness, m.
    axial_width : float
        Width along x, m.
    contact_length : float
        Length of the contact face along its tangent line, m.
    gap : float
        Design gap between neighbouring platforms along the circumference, m.
    edge_angle : float or "auto"
        Slant of the side edges: angle from x to the edge about +z, as the stagger is measured, degrees. "auto": 0
        where the airfoil fits with axial side edges, else the slant that leaves most room.
    fillet_radius : float
        Radius of the fillet between the airfoil and the inner surface, m; 0: none.

    Examples
    --------
    >>> from geometry import ShroudParameters
    >>> shroud = ShroudParameters(angle=45.0, thickness=0.01, axial_width=0.04, contact_length=0.01)
    >>> shroud.gap, shroud.edge_angle
    (0.0, 'auto')
    """

    angle: float
    thickness: float
    axial_width: float
    contact_length: float
    gap: float = 0.0
    edge_angle: float | Literal["auto"] = "auto"
    fillet_radius: float = 0.0


@dataclass(frozen=True)
class SnubberParameters:
    """A part-span snubber: wings on both sides of the airfoil out to a contact plane midway between neighbours.

    It stands around mid chord; at the airfoil it takes up the columns of elements nearest to its width. Lengths along
    the circumference are those at its mid radius.

    Attributes
    ----------
    radius : float
        Mid radius, m.
    thickness : float
        Radial thickness, m.
    width : float
        Width of the contact face along x, m.
    angle : float
        Contact angle, degrees, measured as the shroud angle; within 75 degrees of the engine axis.
    gap : float
        Design gap between neighbours along the circumference, m.

    Examples
    --------
    >>> from geometry import SnubberParameters
    >>> round(1e3 * SnubberParameters(radius=0.35, thickness=0.006, width=0.01, angle=150.0).contact_length, 3)
    11.547
    """

    radius: float
    thickness: float
    width: float
    angle: float = 180.0
    gap: float = 0.0

    @property
    def contact_length(self) -> float:
        """Length of the contact face along its tangent line, m."""
        return self.width / abs(float(np.cos(np.radians(self.angle))))

    @property
    def radii(self) -> tuple[float, float]:
        """Radii of the inner and of the outer surface, m."""
        return self.radius - self.thickness / 2, self.radius + self.thickness / 2


@dataclass(frozen=True)
class PlatformParameters:
    """A platform near the root, with an inclined flank at either end of its underside on which a damper may lie.

    The undersides of neighbours form a roof, symmetric about the plane midway between them, in which the centrifugal
    force presses a damper outward.

    Attributes
    ----------
    radius : float
        Mid radius, m.
    thickness : float
        Radial thickness at the airfoil, m; under the flanks less is left.
    flank_angle : float
        Inclination of the flanks, degrees: 0 is tangential to the ring, with the normal towards the hub.
    flank_length : float or None
        Extent of a flank along the circumference, m; None: so that half the thickness is left at its end, at most the
        thickness.
    width : float or None
        Width along x at its ends, m; None: that of the airfoil. At the airfoil it is as wide as that.
    gap : float or None
        Distance of neighbouring platforms along the circumference, m; None: 2 % of the pitch.

    Examples
    --------
    >>> from geometry import PlatformParameters
    >>> platform = PlatformParameters(radius=0.31, thickness=0.006, flank_angle=45.0)
    >>> round(platform.length_of_flank, 6), platform.radii
    (0.003, (0.307, 0.313))
    """

    radius: float
    thickness: float
    flank_angle: float = 30.0
    flank_length: float | None = None
    width: float | None = None
    gap: float | None = None

    @property
    def length_of_flank(self) -> float:
        """Extent of a flank along the circumference, m."""
        if self.flank_length is not None:
            return self.flank_length
        return self.thickness / (2 * max(float(np.tan(np.radians(self.flank_angle))), 0.5))

    @property
    def radii(self) -> tuple[float, float]:
        """Radii of the inner and of the outer surface at the airfoil, m."""
        return self.radius - self.thickness / 2, self.radius + self.thickness / 2

    def gap_between(self, n_blades: int) -> float:
        """Distance of neighbouring platforms along the circumference, m.

        Parameters
        ----------
        n_blades : int
            Number of blades of the ring.
        """
        return 0.02 * 2 * np.pi * self.radius / n_blades if self.gap is None else self.gap


@dataclass(frozen=True)
class DiskParameters:
    """The disk that carries the blades, of revolution about the engine axis; its rim is the hub.

    Attributes
    ----------
    bore_radius : float
        Inner radius, m.
    rim_width : float
        Axial width at the hub radius, m; the root of the airfoil stands on it.
    bore_width : float or None
        Axial width at the bore, m; None: that of the rim. It varies linearly with the radius.
    profile : tuple of (float, float)
        Further radii (m), ascending, between bore and rim, with the axial widths (m) there.
    bore : {"clamped", "free"}
        Whether the bore is held.
    size : float or None
        Target length of the elements along the radius at the bore, m; it grows to this from that of the blade. None:
        three times that of the blade.

    Examples
    --------
    >>> from geometry import DiskParameters
    >>> DiskParameters(bore_radius=0.1, rim_width=0.05, profile=((0.2, 0.02),)).width(0.25, hub_radius=0.3)
    0.035
    """

    bore_radius: float
    rim_width: float
    bore_width: float | None = None
    profile: tuple[tuple[float, float], ...] = ()
    bore: Literal["clamped", "free"] = "clamped"
    size: float | None = None

    def width(self, radius: float, hub_radius: float) -> float:
        """Axial width at a radius, m.

        Parameters
        ----------
        radius : float
            The radius, m.
        hub_radius : float
            Radius of the rim, m.
        """
        bore = self.rim_width if self.bore_width is None else self.bore_width
        table = np.array([(self.bore_radius, bore), *self.profile, (hub_radius, self.rim_width)])
        return float(np.interp(radius, table[:, 0], table[:, 1]))


@dataclass(frozen=True)
class MeshParameters:
    """Mesh density.

    Attributes
    ----------
    size : float
        Target edge length of the elements, m.
    contact_grid : (int, int)
        Contact nodes on each contact face, along t1 and along t2.
    grading : float
        Ratio of the thickest layer of elements of the airfoil, at mid span, to the thinnest, at the re-entrant
        corners of root and shroud; 1: equal layers.

    Examples
    --------
    >>> from geometry import MeshParameters
    >>> MeshParameters(size=0.002, contact_grid=(4, 3))
    MeshParameters(size=0.002, contact_grid=(4, 3), grading=4.0)
    """

    size: float
    contact_grid: tuple[int, int] = (3, 3)
    grading: float = 4.0
