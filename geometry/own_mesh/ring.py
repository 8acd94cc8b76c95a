"""Engine axis and number of blades of a mesh whose contact faces nobody has named."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geometry.frames import NAMED_AXES, axes_through
from geometry.imported_mesh import ImportedMesh
from geometry.own_mesh.body import boundary, face_sides
from geometry.own_mesh.face_pairing import axis_between
from geometry.own_mesh.pitch_pairs import fitting_number, matched_pairs
from geometry.own_mesh.side_quadrature import quadrature, side_tables

_WIDEST = 2.2  # rad: a sector of a ring of three blades or more


@dataclass(frozen=True)
class SectorRing:
    """A ring that a mesh makes, turned about an axis of its file.

    Attributes
    ----------
    axis : str
        Engine axis in the file: "x", "y" or "z".
    n_blades : int
        Number of blades with which surfaces of the mesh are one pitch apart.
    pairs : int
        Number of pairs of such surfaces.
    axis_point : (float, float, float)
        A point of the engine axis, in the unit of the file.

    Examples
    --------
    >>> from geometry import SectorRing
    >>> SectorRing("z", 24, 1).n_blades
    24
    """

    axis: str
    n_blades: int
    pairs: int
    axis_point: tuple[float, float, float] = (0.0, 0.0, 0.0)


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
    SectorRing(axis='z', n_blades=36, pairs=1, axis_point=(0.0, 0.0, 0.0))
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


def ring_of_faces(mesh: ImportedMesh, right: str, left: str, axis: str | None = None) -> SectorRing | None:
    """The ring in which two named faces lie opposite each other, wherever in the file its axis is.

    Parameters
    ----------
    mesh : ImportedMesh
        The mesh of a sector.
    right, left : str
        Names of node sets or surfaces: two contact faces, or two cut faces.
    axis : str, optional
        The engine axis where it is known: "x", "-x", "y", ...; else all three are tried.

    Returns
    -------
    SectorRing or None
        The ring; None where no axis along x, y or z turns one face into the other.

    Examples
    --------
    A brick, 10 degrees of a ring about an axis along z through the point (0, 5, 0):

    >>> import numpy as np
    >>> from geometry import ElementBlock, ImportedMesh, ring_of_faces
    >>> angle, radius = np.radians([-5.0, 5, 5, -5] * 2), np.array([3.0, 3, 4, 4] * 2)
    >>> points = np.column_stack([radius * np.cos(angle), 5 + radius * np.sin(angle), [0.0] * 4 + [2.0] * 4])
    >>> sets = {"a": np.array([1, 2, 5, 6]), "b": np.array([0, 3, 4, 7])}
    >>> mesh = ImportedMesh("b.inp", points, np.arange(8), (ElementBlock("hex8", np.arange(8)[None]),), (), sets)
    >>> ring_of_faces(mesh, "a", "b")
    SectorRing(axis='z', n_blades=36, pairs=1, axis_point=(0.0, 5.0, 0.0))
    """
    outside = boundary(mesh.blocks)
    faces = [face_sides(mesh, "contact_right", name, outside) for name in (right, left)]
    at = [quadrature(mesh.points, side_tables(mesh.blocks, face)) for face in faces]
    for name in "xyz" if axis is None else (axis,):
        found = axis_between(at[0], at[1], NAMED_AXES[name])
        if found is not None:
            number, point = found
            size = float(np.ptp(mesh.points, axis=0).max())
            rounded = [float(f"{value:.6g}") if abs(value) > 1e-7 * size else 0.0 for value in point]
            return SectorRing(name, number, 1, (rounded[0], rounded[1], rounded[2]))
    return None
