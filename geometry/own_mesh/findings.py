"""What was found when a mesh was taken for a sector."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geometry.sector import FloatArray

_ROUND_OFF = 1e-9


@dataclass(frozen=True)
class SectorFindings:
    """How well the faces of a sector fit.

    Attributes
    ----------
    matching : bool
        Whether the nodes of the faces are pairs under the pitch.
    mismatch : float
        Largest distance, across the normal, from a node of the right face turned back by one pitch to the nearest
        node of the left face, m.
    gap : (float, float)
        Smallest and largest distance along the normal, m; above 0 the faces are apart.
    overlap : float
        Share of the area of either face that has the other opposite.
    areas : (float, float)
        Areas of the right and the left face, m^2.
    normal_angle : float
        Largest angle between a normal and the opposite one, degrees.
    rotation : (3, 3) array
        Our axes x, y, z in the axes of the file, row by row.
    notes : tuple of str
        What was left out, exchanged or assumed, one line each.
    warnings : tuple of str
        What is probably a mistake in the input, one line each.

    Examples
    --------
    >>> import numpy as np
    >>> from geometry import SectorFindings
    >>> found = SectorFindings(True, 1e-9, (4e-5, 5e-5), 1.0, (6e-5, 6e-5), 0.1, np.eye(3), ("root found",))
    >>> print(*found.lines, sep="\\n")
    faces: nodes match, largest mismatch 0.001 um; gap 40 to 50 um
    areas: right 60 mm^2, left 60 mm^2; normals opposite to 0.1 degrees
    axes of the file kept
    root found
    """

    matching: bool
    mismatch: float
    gap: tuple[float, float]
    overlap: float
    areas: tuple[float, float]
    normal_angle: float
    rotation: FloatArray
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def lines(self) -> tuple[str, ...]:
        """The findings as short lines of text."""
        pairs = "nodes match" if self.matching else "nodes do not match"
        low, high = (f"{round(1e6 * gap, 3) + 0.0:.3g}" for gap in self.gap)
        gap = f"gap {low} to {high} um" if low != high else f"gap {low} um"
        shared = "" if self.overlap > 0.995 else f"; {100.0 * self.overlap:.3g} % of the area is opposite"
        right, left = (f"{1e6 * area:.6g}" for area in self.areas)
        angle = round(self.normal_angle, 3)
        return (
            *(f"warning: {warning}" for warning in self.warnings),
            f"faces: {pairs}, largest mismatch {round(1e6 * self.mismatch, 6):.3g} um; {gap}{shared}",
            f"areas: right {right} mm^2, left {left} mm^2; normals opposite to {angle:.2g} degrees",
            _rotation_text(self.rotation),
            *self.notes,
        )


def _rotation_text(rotation: FloatArray) -> str:
    """The rotation in words."""
    if np.array_equal(rotation, np.eye(3)):
        return "axes of the file kept"
    names = [_row(row) for row in rotation]
    return f"turned: our x, y, z are {', '.join(names)} of the file"


def _row(row: FloatArray) -> str:
    for k, axis in enumerate("xyz"):
        if abs(abs(row[k]) - 1.0) < _ROUND_OFF:
            return axis if row[k] > 0.0 else f"-{axis}"
    return f"({', '.join(f'{value:.4g}' for value in row)})"
