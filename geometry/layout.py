"""A plane region cut into patches, as gmsh is to mesh it: named points, divided curves, loops of points."""

from dataclasses import dataclass, field

import numpy as np

from geometry.sector import FloatArray


class MeshingError(RuntimeError):
    """A region that cannot be cut into patches, or that gmsh does not mesh with quadrilaterals alone."""


@dataclass(frozen=True)
class Curve:
    """A straight line between two named points, or a spline through ``through`` (k, 2), and its node positions.

    ``fractions`` run from 0 to 1 along the length, ends included; they must be equal steps on a spline.
    """

    fractions: FloatArray
    through: FloatArray = field(default_factory=lambda: np.empty((0, 2)))


@dataclass(frozen=True)
class Patch:
    """A counterclockwise loop of points. With four ``corners`` the patch is meshed in rows, without them freely."""

    loop: tuple[str, ...]
    corners: tuple[str, ...] = ()
    airfoil: bool = False


@dataclass(frozen=True)
class Layout:
    """Points (2,) by name, curves by their pair of point names, patches that share them, and three paths of points.

    ``cut``: the line through the origin along which the half planform is completed; ``flank``: the airfoil's upper
    side, leading to trailing edge; the contact segment is always the curve from "CB" to "CT".
    """

    name: str
    points: dict[str, FloatArray]
    curves: dict[tuple[str, str], Curve]
    patches: tuple[Patch, ...]
    cut: tuple[str, ...]
    flank: tuple[str, ...]

    @property
    def free(self) -> bool:
        """True where a patch is left to the unstructured mesher."""
        return any(not patch.corners for patch in self.patches)


def equal_steps(count: int) -> FloatArray:
    """Fractions of ``count`` equal steps."""
    return np.linspace(0.0, 1.0, count + 1)
