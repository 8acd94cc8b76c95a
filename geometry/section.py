"""The section of the airfoil in its own coordinates: along the chord from mid chord, and across."""

from dataclasses import dataclass

import numpy as np

from geometry.sector import FloatArray

EDGE_FRACTION = 0.25  # thickness of a lens at its edges, relative to its largest


@dataclass(frozen=True)
class Section:
    """A section of the airfoil.

    "rectangle": constant thickness. "lens": parabolic on both sides, from ``thickness`` at mid chord to a quarter of
    it at the two edges (a sharp edge would leave no room for a hexahedron); its area is 3/4 chord * thickness.

    Attributes
    ----------
    shape : {"rectangle", "lens"}
        Shape of the section.
    chord, thickness : float
        Chord and largest thickness, m.
    offset : float
        How far a fillet moves the outline outward, m; corners stay corners.
    """

    shape: str
    chord: float
    thickness: float
    offset: float = 0.0

    @property
    def half_length(self) -> float:
        """Half the length along the chord, m."""
        return self.chord / 2 + self.offset

    @property
    def straight(self) -> bool:
        """True where both flanks are straight lines."""
        return self.shape == "rectangle"

    def half_thickness(self, along: FloatArray) -> FloatArray:
        """Half thickness (m) at the distance ``along`` (m) from mid chord."""
        if self.shape == "rectangle":
            return np.full(np.shape(along), self.thickness / 2 + self.offset)
        if self.offset > 0:  # beyond the ends of the section itself
            along = np.clip(along, -self.chord / 2, self.chord / 2)
        bulge = 1 - (2 * np.asarray(along) / self.chord) ** 2
        return self.thickness / 2 * (EDGE_FRACTION + (1 - EDGE_FRACTION) * bulge) + self.offset
