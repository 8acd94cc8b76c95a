"""A plane region divided into patches for gmsh: named points, divided curves, loops of points."""

from dataclasses import dataclass, field

import numpy as np

from geometry.sector import FloatArray


class MeshingError(RuntimeError):
    """A region that cannot be divided into patches, or that gmsh does not mesh with quadrilaterals alone."""


@dataclass(frozen=True)
class Curve:
    """A straight line between two named points, or a spline, with its node positions."""

    fractions: FloatArray  # (n,), node positions from 0 to 1 along the length, ends included; equal steps on a spline
    # (k, 2), inner points of a spline; none for a line
    through: FloatArray = field(default_factory=lambda: np.empty((0, 2)))


@dataclass(frozen=True)
class Patch:
    """A counterclockwise loop of points; meshed in rows with four ``corners``, unstructured without."""

    loop: tuple[str, ...]
    corners: tuple[str, ...] = ()
    airfoil: bool = False


@dataclass(frozen=True)
class Layout:
    """Points, curves and patches of half a planform. The contact segment is the curve from "CB" to "CT"."""

    name: str  # name of the layout
    points: dict[str, FloatArray]  # (2,), points by name
    curves: dict[tuple[str, str], Curve]  # curves by the names of their ends
    patches: tuple[Patch, ...]  # patches, which share curves
    cut: tuple[str, ...]  # path through the origin, along which the other half is joined
    flank: tuple[str, ...]  # path along the upper side of the airfoil, from leading to trailing edge

    @property
    def free(self) -> bool:
        """True where a patch is unstructured."""
        return any(not patch.corners for patch in self.patches)


def equal_steps(count: int) -> FloatArray:
    """Fractions of ``count`` equal steps."""
    return np.linspace(0.0, 1.0, count + 1)
