"""A plane region divided into patches for gmsh: named points, divided curves, loops of points."""

from dataclasses import dataclass, field

import numpy as np

from geometry.sector import FloatArray


class MeshingError(RuntimeError):
    """A region that cannot be divided into patches, or that gmsh does not mesh with quadrilaterals alone."""


@dataclass(frozen=True)
class Curve:
    """A straight line between two named points, or a spline, with its node positions.

    Attributes
    ----------
    fractions : (n,) array
        Node positions from 0 to 1 along the length, ends included; equal steps on a spline.
    through : (k, 2) array
        Inner points of a spline; none for a line.
    """

    fractions: FloatArray
    through: FloatArray = field(default_factory=lambda: np.empty((0, 2)))


@dataclass(frozen=True)
class Patch:
    """A counterclockwise loop of points; meshed in rows with four ``corners``, unstructured without."""

    loop: tuple[str, ...]
    corners: tuple[str, ...] = ()
    airfoil: bool = False


@dataclass(frozen=True)
class Layout:
    """Points, curves and patches of half a planform. The contact segment is the curve from "CB" to "CT".

    Attributes
    ----------
    name : str
        Name of the layout.
    points : dict of str to (2,) array
        Points by name.
    curves : dict of (str, str) to Curve
        Curves by the names of their ends.
    patches : tuple of Patch
        Patches, which share curves.
    cut : tuple of str
        Path through the origin, along which the other half is joined.
    flank : tuple of str
        Path along the upper side of the airfoil, from leading to trailing edge.
    """

    name: str
    points: dict[str, FloatArray]
    curves: dict[tuple[str, str], Curve]
    patches: tuple[Patch, ...]
    cut: tuple[str, ...]
    flank: tuple[str, ...]

    @property
    def free(self) -> bool:
        """True where a patch is unstructured."""
        return any(not patch.corners for patch in self.patches)


def equal_steps(count: int) -> FloatArray:
    """Fractions of ``count`` equal steps."""
    return np.linspace(0.0, 1.0, count + 1)
