"""Engine axis and number of blades of a mesh whose contact faces nobody has named."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geometry.engine_axes import NAMED_AXES, axes_through
from geometry.imported_mesh import ImportedMesh
from geometry.own_mesh.body import boundary
from geometry.own_mesh.candidates import fitting_number, matched_pairs

_WIDEST = 2.2  # rad: a sector of a ring of three blades or more


@dataclass(frozen=True)
class SectorRing:
    """A ring that a mesh makes, turned about an axis through the origin of its file.

    Attributes
    ----------
    axis : str
        Engine axis in the file: "x", "y" or "z".
    n_blades : int
        Number of blades with which surfaces of the mesh are one pitch apart.
    pairs : int
        Number of pairs of such surfaces.

    Examples
    --------
    >>> from geometry import SectorRing
    >>> SectorRing("z", 24, 1).n_blades
    24
    """

    axis: str
    n_blades: int
    pairs: int


def fitting_ring(mesh: ImportedMesh, axis: str | None = None) -> SectorRing | None:
    """The ring in which most element sides of a mesh are one pitch from another one, node by node.

    Parameters
    ----------
    mesh : ImportedMesh
        The mesh of a sector.
    axis : str, optional
        The engine axis where it is known: "x", "-x", "y", ...; else all three are tried.

    Returns
    -------
    SectorRing or None
        The ring; None where no surfaces match under the pitch of any number of blades.

    Examples
    --------
    A brick, 10 degrees of a ring about z:

    >>> import numpy as np
    >>> from geometry import ElementBlock, ImportedMesh, fitting_ring
    >>> angle, radius = np.radians([-5.0, 5, 5, -5] * 2), np.array([3.0, 3, 4, 4] * 2)
    >>> points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), [0.0] * 4 + [2.0] * 4])
    >>> mesh = ImportedMesh("b.inp", points, np.arange(8), (ElementBlock("hex8", np.arange(8)[None]),), ())
    >>> fitting_ring(mesh)
    SectorRing(axis='z', n_blades=36, pairs=1)
    """
    if mesh.n_elements == 0:
        return None
    outside = boundary(mesh.blocks)
    found: list[tuple[int, SectorRing]] = []
    for name in "xyz" if axis is None else (axis,):
        direction = NAMED_AXES[name]
        middle = mesh.points.mean(axis=0)
        if np.linalg.norm(np.cross(middle, direction)) <= 1e-9 * np.ptp(mesh.points):
            continue
        points = mesh.points @ axes_through(direction, middle).T
        if np.ptp(np.arctan2(points[:, 1], points[:, 2])) > _WIDEST:
            continue
        number = fitting_number(points, mesh.blocks, outside)
        if number is not None and number >= 3:
            pairs = matched_pairs(points, mesh.blocks, outside, 2.0 * np.pi / number)
            found.append((sum(len(pair.right) for pair in pairs), SectorRing(name, number, len(pairs))))
    return max(found, key=lambda each: each[0])[1] if found else None
